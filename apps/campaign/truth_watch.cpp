#include "apps/campaign/truth_watch.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "emulator/nodes/measuring/force_torque_kind.h"

namespace walkman::apps {
namespace {

constexpr double kJointOff = 0.01;  // rad
constexpr double kPlaceOff = 0.01;  // m
// Window on the golden twin's path, cycles, in which a run that is earlier or later is searched for.
constexpr std::size_t kPathBehind = 20, kPathAhead = 200;
constexpr double kMomentaryPeak = 2;
constexpr double kAtStop = 0.001;      // rad
constexpr double kHardStop = 0.1;      // rad/s
constexpr double kFallen = 0.5;        // rad
constexpr double kFallingSpeed = 0.5;  // m/s, after 13 mm of free fall; the method lowers at a fifth of it
// Time, s, for which the robot is watched after its drives were told to stop, and for which it has to stand
// still within that: more than half a period of its slowest sway, 1.24 Hz.
constexpr double kWatched = 1.5, kStillFor = 0.45;

void mix(std::uint64_t& hash, std::uint64_t value) {
  hash = (hash ^ value) * 1099511628211ULL;  // FNV-1a, by words
}

}  // namespace

double TruthWatch::now() const { return std::chrono::duration<double>(world_->emulator.now()).count(); }

void TruthWatch::begins(EmulatedWorld& world, const robot::Robot& robot, const Judge& judge) {
  world_ = &world;
  robot_ = &robot;
  judge_ = &judge;
  for (bus::CanBus* bus : world.emulator.buses())
    bus->set_observer([this](const can::StampedFrame& stamped) {
      mix(frames_hash_, static_cast<std::uint64_t>(stamped.time.count()));
      std::uint64_t data = stamped.frame.id;
      for (std::size_t i = 0; i < stamped.frame.length; ++i) {
        data = data << 8 | stamped.frame.data[i];
        if (i % 4 == 3) mix(frames_hash_, data);
      }
      mix(frames_hash_, data);
    });
  watch_devices();
  up_B_ = world.emulator.plant().X_WL(0).linear().row(2).transpose();
}

void TruthWatch::watch_devices() {
  const RobotModel& model = world_->robot.model;
  for (const Bus& bus : world_->robot.devices.buses) {
    for (const Device& device : bus.devices) {
      if (device.kind == DeviceKind::kJointDrive) {
        const int index = model.joint_index(device.name);
        const JointLimits& limits = model.joints[static_cast<std::size_t>(index)].limits;
        joints_.push_back({index, device.name, limits.lower, limits.upper, limits.effort});
      } else if (device.kind == DeviceKind::kForceTorque) {
        const ForceTorqueKind kind = load_force_torque_kind(sensor_folder_ / (device.sensor + ".yaml"));
        WatchedSensor sensor{device.name, {}};
        sensor.range << kind.torque_range, kind.force_range;
        sensors_.push_back(std::move(sensor));
      }
    }
  }
}

void TruthWatch::cycle() {
  compare();
  watch_limits();
  watch_faults();
  ++cycle_;
}

void TruthWatch::compare() {
  const plant::Plant& plant = world_->emulator.plant();
  positions_.clear();
  for (const WatchedJoint& joint : joints_)
    positions_.push_back(static_cast<float>(plant.joint_position(joint.joint)));
  path_.insert(path_.end(), positions_.begin(), positions_.end());
  const auto place = [&](const Eigen::Isometry3d& X_W) {
    for (int i = 0; i < 3; ++i) positions_.push_back(static_cast<float>(X_W.translation()[i]));
  };
  place(plant.X_WL(0));
  for (std::size_t i = 0; i < world_->scene.objects.size(); ++i) place(plant.X_WO(static_cast<int>(i)));
  std::uint64_t hash = plant.state_hash();
  mix(hash, frames_hash_);
  if (golden_ == nullptr) {
    trace_.add(hash, positions_);
    return;
  }
  if (!observation_.differs && (cycle_ >= golden_->cycles() || golden_->hash(cycle_) != hash))
    observation_.differs = now();
  if (observation_.differs && !observation_.off && off_path()) observation_.off = now();
}

bool TruthWatch::off_path() {
  double least = std::numeric_limits<double>::infinity();
  const std::size_t from = place_on_path_ - std::min(place_on_path_, kPathBehind);
  const std::size_t end = std::min(golden_->cycles(), std::max(place_on_path_, cycle_) + kPathAhead);
  for (std::size_t cycle = from; cycle < end && least > 0; ++cycle) {
    const auto golden = golden_->positions(cycle);
    double most = 0;  // relative to the allowed deviation
    for (std::size_t i = 0; i < golden.size() && most < least; ++i) {
      const double allowed = i < joints_.size() ? kJointOff : kPlaceOff;
      most = std::max(most, std::abs(static_cast<double>(positions_[i] - golden[i])) / allowed);
    }
    if (most >= least) continue;
    least = most;
    place_on_path_ = cycle;
  }
  return least > 1;
}

void TruthWatch::pass(const std::string& what, double value, double limit) {
  const bool known = std::any_of(observation_.limits.begin(), observation_.limits.end(),
                                 [&](const PassedLimit& passed) { return passed.what == what; });
  if (!known) observation_.limits.push_back({what, now(), value, limit});
}

void TruthWatch::watch_limits() {
  const plant::Plant& plant = world_->emulator.plant();
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
  const double lean = std::acos(std::clamp(plant.X_WL(0).linear().row(2).dot(up_B_), -1.0, 1.0));
  if (lean > kFallen) pass("lean of the base, rad", lean, kFallen);
  const double dt = now() - last_time_;
  last_time_ = now();
  heights_.resize(world_->scene.objects.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; i < heights_.size(); ++i) {
    const double height = plant.X_WO(static_cast<int>(i)).translation().z();
    const double speed = (heights_[i] - height) / dt;
    if (speed > kFallingSpeed)
      pass("fall of " + world_->scene.objects[i].name + ", m/s", speed, kFallingSpeed);
    heights_[i] = height;
  }
  const std::vector<UnwantedTouch>& touches = judge_->touches();
  for (; touches_ < touches.size(); ++touches_)
    pass(fmt::format("{} against {}, N", touches[touches_].link, touches[touches_].other),
         touches[touches_].force, 0);
}

void TruthWatch::find_standstill() {
  const std::size_t width = joints_.size(), cycles = path_.size() / width;
  const double period = now() / static_cast<double>(cycles);
  std::vector<float> least(path_.end() - static_cast<std::ptrdiff_t>(width), path_.end()), most = least;
  observation_.still = 0;
  for (std::size_t before = cycles - 1; before > 0; --before) {
    for (std::size_t i = 0; i < width; ++i) {
      const float position = path_[(before - 1) * width + i];
      least[i] = std::min(least[i], position);
      most[i] = std::max(most[i], position);
      if (static_cast<double>(most[i] - least[i]) <= 2 * kJointOff) continue;
      observation_.still = static_cast<double>(before + 1) * period;
      if (now() - *observation_.still >= kStillFor) return;
      observation_.still.reset();
      observation_.moving = joints_[i].name;
      return;
    }
  }
}

void TruthWatch::watch_faults() {
  const auto& fault = robot_->fault();
  if (fault && fault->time != last_fault_) {
    last_fault_ = fault->time;
    show(ShownEvent::By::kDriver, std::chrono::duration<double>(fault->time).count(), fault->device,
         fault->text);
  }
  // A fault that was cleared in the same cycle in which it was latched.
  const std::vector<std::string>& recovered = judge_->recovered_from();
  for (; recoveries_ < recovered.size(); ++recoveries_) {
    const auto is_it = [&](const ShownEvent& event) { return event.text == recovered[recoveries_]; };
    if (std::any_of(observation_.events.begin(), observation_.events.end(), is_it)) continue;
    show(ShownEvent::By::kDriver, now(), device_in(recovered[recoveries_]), recovered[recoveries_]);
  }
}

void TruthWatch::warned(std::string_view sentence) {
  show(ShownEvent::By::kWarning, now(), device_in(sentence), std::string(sentence));
}

void TruthWatch::show(ShownEvent::By by, double time, std::string device, std::string text) {
  observation_.events.push_back({by, time, std::move(device), std::move(text)});
}

std::string TruthWatch::device_in(std::string_view text) const {
  std::string longest;
  for (const Bus& bus : world_->robot.devices.buses) {
    if (text.find(bus.interface) != std::string_view::npos && longest.empty()) longest = bus.interface;
    for (const Device& device : bus.devices) {
      const std::size_t at = text.find(device.name);
      const std::size_t end = at + device.name.size();
      const bool whole = at != std::string_view::npos &&
                         (end == text.size() || std::isalnum(static_cast<unsigned char>(text[end])) == 0);
      if (whole) return device.name;
    }
  }
  return longest;
}

void TruthWatch::over(const RepetitionResult& result, robot::Cycle& cycle) {
  observation_.result = result;
  observation_.ended = now();
  observation_.object = world_->scene.objects[static_cast<std::size_t>(judge_->object())].name;
  watch_faults();
  const bool by_driver =
      std::any_of(observation_.events.begin(), observation_.events.end(), [&](const ShownEvent& event) {
        return event.by == ShownEvent::By::kDriver && result.reason.starts_with(event.text);
      });
  if (result.outcome == Outcome::kStopped && !by_driver)
    show(ShownEvent::By::kMethod, observation_.ended, device_in(result.reason), result.reason);
  if (result.outcome == Outcome::kRegraspLimit)
    show(ShownEvent::By::kMethod, observation_.ended, "", to_string(result.outcome));
  while (now() - observation_.ended < kWatched) cycle.next();
  find_standstill();
}

}  // namespace walkman::apps
