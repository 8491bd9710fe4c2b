#include "emulator/nodes/measuring/force_torque_kind.h"

#include <limits>
#include <random>

#include "urdf/reader/yaml_map.h"

namespace walkman {
namespace {

double no_less(const YamlMap& map, const std::string& key, double least) {
  const double value = map.number(key);
  if (value < least) map.fail(key, "expected a number not below " + std::to_string(least));
  return value;
}

double positive(const YamlMap& map, const std::string& key) {
  const double value = map.number(key);
  if (value <= 0) map.fail(key, "expected a positive number");
  return value;
}

double share(const YamlMap& map, const std::string& key) {
  const double value = no_less(map, key, 0);
  if (value > 0.2) map.fail(key, "expected a share of the range, at most 0.2");
  return value;
}

Eigen::Vector3d positive3(const YamlMap& map, const std::string& key) {
  Eigen::Vector3d value = map.vector3(key);
  if (value.minCoeff() <= 0) map.fail(key, "expected three positive numbers");
  return value;
}

}  // namespace

ForceTorqueKind load_force_torque_kind(const std::filesystem::path& file) {
  const YamlMap map(
      file.string(), parse_yaml_file(file), "",
      {"force_range", "torque_range", "force_resolution", "torque_resolution", "noise", "force_bias",
       "torque_bias", "cross_talk", "ambient", "warm_up", "warm_up_time", "drift", "low_pass"});
  constexpr double kAbsoluteZero = -273.15;  // °C
  ForceTorqueKind kind;
  kind.force_range = positive3(map, "force_range");
  kind.torque_range = positive3(map, "torque_range");
  kind.force_resolution = positive3(map, "force_resolution");
  kind.torque_resolution = positive3(map, "torque_resolution");
  if ((kind.force_resolution.array() >= kind.force_range.array()).any())
    map.fail("force_resolution", "expected less than force_range");
  if ((kind.torque_resolution.array() >= kind.torque_range.array()).any())
    map.fail("torque_resolution", "expected less than torque_range");
  kind.noise = no_less(map, "noise", 0);
  kind.force_bias = no_less(map, "force_bias", 0);
  kind.torque_bias = no_less(map, "torque_bias", 0);
  kind.cross_talk = share(map, "cross_talk");
  kind.ambient_c = no_less(map, "ambient", kAbsoluteZero);
  kind.warm_up = no_less(map, "warm_up", 0);
  kind.warm_up_time = positive(map, "warm_up_time");
  kind.drift = share(map, "drift");
  kind.low_pass_hz = no_less(map, "low_pass", 0);
  return kind;
}

nodes::ForceTorqueParameters draw_sensor(const ForceTorqueKind& kind, SensorErrors errors, std::uint64_t seed,
                                         std::uint8_t node_id) {
  nodes::ForceTorqueParameters sensor;
  sensor.node_id = node_id;
  nodes::Vector6 range, resolution;
  range << kind.force_range, kind.torque_range;
  resolution << kind.force_resolution, kind.torque_resolution;
  for (std::size_t i = 0; i < 6; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    sensor.channels[i] = {range[axis], resolution[axis]};
    if (errors == SensorErrors::kNone) sensor.channels[i] = {std::numeric_limits<double>::infinity(), 0};
  }
  nodes::TransducerParameters& transducer = sensor.transducer;
  transducer.ambient_c = kind.ambient_c;
  transducer.warm_up = kind.warm_up;
  transducer.warm_up_time = kind.warm_up_time;
  if (errors == SensorErrors::kNone) return sensor;

  std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32U),
                         static_cast<std::uint32_t>(node_id)};
  std::mt19937_64 generator(sequence);
  std::uniform_real_distribution<double> spread(-1, 1);
  transducer.noise = kind.noise * resolution;
  nodes::Vector6 bias, drift;
  for (Eigen::Index i = 0; i < 6; ++i)
    bias[i] = spread(generator) * (i < 3 ? kind.force_bias : kind.torque_bias);
  transducer.noise_seed = generator();
  if (errors == SensorErrors::kNoiseAndResolution) return sensor;
  for (Eigen::Index i = 0; i < 6; ++i) drift[i] = spread(generator) * kind.drift * range[i];
  transducer.bias = bias;
  transducer.drift_per_kelvin = drift;
  for (Eigen::Index i = 0; i < 6; ++i) {
    for (Eigen::Index k = 0; k < 6; ++k)
      transducer.cross_talk(i, k) += spread(generator) * kind.cross_talk * range[i] / range[k];
  }
  transducer.low_pass_hz = kind.low_pass_hz;
  return sensor;
}

}  // namespace walkman
