#include "drivers/cia404/inertial_unit.h"

#include <cmath>

#include "drivers/canopen/objects.h"

namespace walkman::cia404 {
namespace {

namespace object = canopen::object;

constexpr double kForceUnit = 1e-3;  // m/s^2
constexpr double kRateUnit = 1e-3;   // rad/s
constexpr double kQuaternionUnit = 1.0 / 30000;

// A quaternion's norm may be off by rounding; one that is far off is not an orientation.
constexpr double kLengthTolerance = 0.05;

}  // namespace

InertialUnit::InertialUnit(const canopen::NodeSettings& settings) : MeasuringDevice(settings, kChannels) {
  set_measuring_steps({});
}

bool InertialUnit::decode(const ChannelSample& channels) noexcept {
  for (int i = 0; i < 3; ++i) {
    const auto channel = static_cast<std::size_t>(i);
    sample_.specific_force[i] = channels.raw(channel) * kForceUnit;
    sample_.angular_velocity[i] = channels.raw(channel + 3) * kRateUnit;
  }
  const Eigen::Quaterniond q(channels.raw(6) * kQuaternionUnit, channels.raw(7) * kQuaternionUnit,
                             channels.raw(8) * kQuaternionUnit, channels.raw(9) * kQuaternionUnit);
  if (std::abs(q.norm() - 1) >= kLengthTolerance) return false;
  sample_.R_WS = q.normalized();
  return true;
}

canopen::DevicePdos InertialUnit::factory_pdos() {
  canopen::DevicePdos pdos = vector_pdos();
  constexpr std::uint16_t kValue = object::kProcessValueInt16;
  enable(pdos.transmit[2], 1, {{kValue, 7, 16}, {kValue, 8, 16}, {kValue, 9, 16}, {kValue, 10, 16}});
  return pdos;
}

}  // namespace walkman::cia404
