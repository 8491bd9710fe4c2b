#include "drivers/cia404/inertial_unit.h"

#include <cmath>

namespace walkman::imu {
namespace {

constexpr double kForceUnit = 1e-3;  // m/s^2
constexpr double kRateUnit = 1e-3;   // rad/s
constexpr double kQuaternionUnit = 1.0 / 30000;

// A quaternion's length may be off by rounding; one that is far off is none.
constexpr double kLengthTolerance = 0.05;

}  // namespace

InertialUnit::InertialUnit(const canopen::NodeSettings& settings)
    : RemoteNode(settings), channels_(settings.pdos, kChannels, settings.cycle) {
  std::vector<canopen::SdoStep> steps = canopen::identity_steps_of(settings, kInertialUnitType);
  for (const auto& more :
       {canopen::supervision_steps(settings), canopen::pdo_steps(settings.pdos, settings.node_id)}) {
    steps.insert(steps.end(), more.begin(), more.end());
  }
  set_configuration(std::move(steps));
}

void InertialUnit::on_begin_boot() noexcept {
  channels_.reset();
  sample_ = InertialSample{};
}

void InertialUnit::on_tpdo(int number, const can::StampedFrame& stamped) noexcept {
  if (!channels_.take(number, stamped)) return;
  sample_.out_of_range = false;
  for (std::size_t i = 0; i < kChannels; ++i) {
    sample_.out_of_range = sample_.out_of_range || channels_.at_an_end(i);
  }
  for (int i = 0; i < 3; ++i) {
    const auto channel = static_cast<std::size_t>(i);
    sample_.specific_force[i] = channels_.raw(channel) * kForceUnit;
    sample_.angular_velocity[i] = channels_.raw(channel + 3) * kRateUnit;
  }
  const Eigen::Quaterniond q(channels_.raw(6) * kQuaternionUnit, channels_.raw(7) * kQuaternionUnit,
                             channels_.raw(8) * kQuaternionUnit, channels_.raw(9) * kQuaternionUnit);
  if (std::abs(q.norm() - 1) < kLengthTolerance) {
    sample_.R_WS = q.normalized();
  } else {
    sample_.out_of_range = true;
  }
  sample_.counter = channels_.counter();
  sample_.status = channels_.status();
  sample_.at = channels_.at();
}

}  // namespace walkman::imu
