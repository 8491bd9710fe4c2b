#include "emulator/nodes/measuring/inertial_node.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "drivers/canopen/objects.h"
#include "emulator/nodes/cia301/object_table.h"

namespace walkman::nodes {

namespace object = canopen::object;

namespace {

constexpr std::uint32_t kInertialProduct = 3;

// CiA 303-2. A specific force is a force per mass: newton (21h) per kilogram (02h). 10h rad, 03h s.
constexpr std::uint32_t kNewtonPerKilogram = 0x00210200;
constexpr std::uint32_t kRadianPerSecond = 0x00100300;
constexpr std::uint32_t kNoUnit = 0;
// 6110h, in the manufacturer-specific range, as in commercial inertial units.
constexpr std::uint16_t kAccelerometer = 10501;
constexpr std::uint16_t kGyroscope = 10401;

constexpr double kSpecificForceUnit = 0.001;
constexpr double kRateUnit = 0.001;

std::array<ChannelDescription, InertialNode::kChannels> describe(const InertialParameters& p) {
  constexpr std::uint8_t kDigits = 3;
  const ChannelDescription force{p.force_range,  kSpecificForceUnit, kSpecificForceUnit,
                                 kAccelerometer, kNewtonPerKilogram, kDigits,
                                 false};
  const ChannelDescription rate{p.rate_range,     kRateUnit, kRateUnit, kGyroscope,
                                kRadianPerSecond, kDigits,   false};
  const ChannelDescription turn{
      1, kQuaternionUnit, kQuaternionUnit, kOrientationSensor, kNoUnit, std::nullopt, false};
  return {force, force, force, rate, rate, rate, turn, turn, turn, turn};
}

}  // namespace

InertialNode::InertialNode(const InertialParameters& parameters)
    : MeasuringNode(
          {parameters.node_id, kAnalogueInputType, parameters.name, kInertialProduct, parameters.serial},
          describe(parameters), parameters.sample_period_us),
      parameters_(parameters),
      generator_(parameters.noise_seed) {
  constexpr std::uint16_t kValue = object::kProcessValueInt16;
  PdoSet transmit = vector_tpdos();
  transmit[2] = {
      true,
      1,
      0,
      {mapped(kValue, 7, 16), mapped(kValue, 8, 16), mapped(kValue, 9, 16), mapped(kValue, 10, 16)}};
  configure_pdos({}, transmit);
}

Eigen::Quaterniond InertialNode::estimate(const Eigen::Quaterniond& q_WS) const noexcept {
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  Eigen::Quaterniond q = AngleAxisd(yaw_error_, Vector3d::UnitZ()) *
                         AngleAxisd(parameters_.tilt_error[1], Vector3d::UnitY()) *
                         AngleAxisd(parameters_.tilt_error[0], Vector3d::UnitX()) * q_WS;
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  return q;
}

void InertialNode::sample(const InertialReadings& readings) noexcept {
  yaw_error_ = std::remainder(yaw_error_ + parameters_.yaw_drift * parameters_.sample_period_us * kMicro,
                              2 * std::numbers::pi);
  std::array<double, kChannels> values{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    values[i] = readings.specific_force_S[axis] + parameters_.force_bias[i] +
                parameters_.force_noise * normal_(generator_);
    values[i + 3] = readings.angular_velocity_S[axis] + parameters_.rate_bias[i] +
                    parameters_.rate_noise * normal_(generator_);
  }
  const Eigen::Quaterniond q = estimate(readings.q_WS);
  values[6] = q.w();
  values[7] = q.x();
  values[8] = q.y();
  values[9] = q.z();
  // By rounding, a component of a unit quaternion may slightly exceed 1.
  for (std::size_t i = 6; i < kChannels; ++i) values[i] = std::clamp(values[i], -1.0, 1.0);
  take_sample(values);
}

void InertialNode::on_reset() noexcept {
  MeasuringNode::on_reset();
  yaw_error_ = 0;
}

}  // namespace walkman::nodes
