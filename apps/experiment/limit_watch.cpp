#include "apps/experiment/limit_watch.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "emulator/nodes/measuring/force_torque_kind.h"

namespace walkman::apps {
namespace {

constexpr double kMomentaryPeak = 2;
constexpr double kAtStop = 0.001;      // rad
constexpr double kHardStop = 0.1;      // rad/s
constexpr double kFallen = 0.5;        // rad
constexpr double kFallingSpeed = 0.5;  // m/s, after 13 mm of free fall; the method lowers at a fifth of it

}  // namespace

std::string to_string(const PassedLimit& passed) {
  return fmt::format("{}: {:.4g} at {:.3f} s, expected at most {:.4g}", passed.what, passed.value,
                     passed.time, passed.limit);
}

LimitWatch::LimitWatch(EmulatedWorld& world, const std::filesystem::path& sensors)
    : world_(world),
      heights_(world.scene.objects.size(), std::numeric_limits<double>::quiet_NaN()),
      up_B_(world.emulator.plant().X_WL(0).linear().row(2).transpose()) {
  const RobotModel& model = world.robot.model;
  for (const Bus& bus : world.robot.devices.buses) {
    for (const Device& device : bus.devices) {
      if (device.kind == DeviceKind::kJointDrive) {
        const int index = model.joint_index(device.name);
        const JointLimits& limits = model.joints[static_cast<std::size_t>(index)].limits;
        joints_.push_back({index, device.name, limits.lower, limits.upper, limits.effort});
      } else if (device.kind == DeviceKind::kForceTorque) {
        const ForceTorqueKind kind = load_force_torque_kind(sensors / (device.sensor + ".yaml"));
        WatchedSensor sensor{device.name, {}};
        sensor.range << kind.torque_range, kind.force_range;
        sensors_.push_back(std::move(sensor));
      }
    }
  }
}

void LimitWatch::step() {
  now_ = std::chrono::duration<double>(world_.emulator.now()).count();
  watch_joints();
  watch_sensors();
  watch_falls();
  last_time_ = now_;
}

void LimitWatch::pass(const std::string& what, double value, double limit) {
  const bool known = std::any_of(passed_.begin(), passed_.end(),
                                 [&](const PassedLimit& passed) { return passed.what == what; });
  if (!known) passed_.push_back({what, now_, value, limit});
}

void LimitWatch::watch_joints() {
  const plant::Plant& plant = world_.emulator.plant();
  for (WatchedJoint& joint : joints_) {
    const double torque = std::abs(plant.joint_torque(joint.joint));
    if (torque > kMomentaryPeak * joint.effort)
      pass("torque of " + joint.name + ", N·m", torque, kMomentaryPeak * joint.effort);
    const double position = plant.joint_position(joint.joint);
    if (position < joint.lower + kAtStop && joint.speed < -kHardStop)
      pass("speed into the lower stop of " + joint.name + ", rad/s", -joint.speed, kHardStop);
    if (position > joint.upper - kAtStop && joint.speed > kHardStop)
      pass("speed into the upper stop of " + joint.name + ", rad/s", joint.speed, kHardStop);
    joint.speed = plant.joint_velocity(joint.joint);
  }
}

void LimitWatch::watch_sensors() {
  const plant::Plant& plant = world_.emulator.plant();
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    const Wrench& F = plant.F_So_S(static_cast<int>(i));
    Eigen::Matrix<double, 6, 1> load;
    load << F.torque, F.force;
    for (int axis = 0; axis < 6; ++axis)
      if (std::abs(load[axis]) > sensors_[i].range[axis])
        pass(fmt::format("{} on {}, {}", axis < 3 ? "torque" : "force", sensors_[i].name,
                         axis < 3 ? "N·m" : "N"),
             std::abs(load[axis]), sensors_[i].range[axis]);
  }
}

void LimitWatch::watch_falls() {
  const plant::Plant& plant = world_.emulator.plant();
  const double lean = std::acos(std::clamp(plant.X_WL(0).linear().row(2).dot(up_B_), -1.0, 1.0));
  if (lean > kFallen) pass("lean of the base, rad", lean, kFallen);
  for (std::size_t i = 0; i < heights_.size(); ++i) {
    const double height = plant.X_WO(static_cast<int>(i)).translation().z();
    const double speed = (heights_[i] - height) / (now_ - last_time_);
    if (speed > kFallingSpeed)
      pass("fall of " + world_.scene.objects[i].name + ", m/s", speed, kFallingSpeed);
    heights_[i] = height;
  }
}

}  // namespace walkman::apps
