#include "emulator/nodes/measuring/force_torque_kind.h"

#include <limits>
#include <random>

#include <fmt/format.h>

#include "urdf/reader/yaml_map.h"

namespace walkman {
namespace {

double positive(const YamlMap& map, const std::string& key) {
  const double value = map.number(key);
  if (value <= 0) map.fail(key, fmt::format("found {}, expected more than 0", value));
  return value;
}

Eigen::Vector3d positive3(const YamlMap& map, const std::string& key) {
  Eigen::Vector3d value = map.vector3(key);
  if (value.minCoeff() <= 0) map.fail(key, fmt::format("found {}, expected more than 0", value.minCoeff()));
  return value;
}

}  // namespace

ForceTorqueKind load_force_torque_kind(const std::filesystem::path& file) {
  const YamlMap map(
      file.string(), parse_yaml_file(file), "",
      {"force_range", "torque_range", "force_resolution", "torque_resolution", "noise", "force_bias",
       "torque_bias", "cross_talk", "ambient", "warm_up", "warm_up_time", "drift", "low_pass"});
  constexpr double kAbsoluteZero = -273.15;  // °C
  constexpr double kMost = 1e6;              // in each value's own unit
  constexpr double kMostShare = 0.2;         // of the range
  ForceTorqueKind kind;
  kind.force_range = positive3(map, "force_range");
  kind.torque_range = positive3(map, "torque_range");
  kind.force_resolution = positive3(map, "force_resolution");
  kind.torque_resolution = positive3(map, "torque_resolution");
  if ((kind.force_resolution.array() >= kind.force_range.array()).any())
    map.fail("force_resolution", "expected less than force_range");
  if ((kind.torque_resolution.array() >= kind.torque_range.array()).any())
    map.fail("torque_resolution", "expected less than torque_range");
  kind.noise = map.number("noise", 0, kMost);
  kind.force_bias = map.number("force_bias", 0, kMost);
  kind.torque_bias = map.number("torque_bias", 0, kMost);
  kind.cross_talk = map.number("cross_talk", 0, kMostShare);
  kind.ambient_c = map.number("ambient", kAbsoluteZero, kMost);
  kind.warm_up = map.number("warm_up", 0, kMost);
  kind.warm_up_time = positive(map, "warm_up_time");
  kind.drift = map.number("drift", 0, kMostShare);
  kind.low_pass_hz = map.number("low_pass", 0, kMost);
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
