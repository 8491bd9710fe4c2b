#include "apps/campaign/truth_watch.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace walkman::apps {
namespace {

constexpr double kJointOff = 0.01;  // rad
constexpr double kPlaceOff = 0.01;  // m
// Window on the golden twin's path, cycles, in which a run that is earlier or later is searched for.
constexpr std::size_t kPathBehind = 20, kPathAhead = 200;
// Time, s, for which the robot is watched after its drives were told to stop, and for which it has to stand
// still within that: more than half a period of its slowest sway, 1.24 Hz.
constexpr double kWatched = 1.5, kStillFor = 0.45;

void mix(std::uint64_t& hash, std::uint64_t value) {
  hash = (hash ^ value) * 1099511628211ULL;  // FNV-1a, by words
}

}  // namespace

double TruthWatch::now() const { return std::chrono::duration<double>(world_->emulator.now()).count(); }

void TruthWatch::begins(EmulatedWorld& world, const robot::Robot& robot, const Judge& judge,
                        const LimitWatch& limits) {
  world_ = &world;
  robot_ = &robot;
  judge_ = &judge;
  limits_ = &limits;
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
  for (const Bus& bus : world.robot.devices.buses) {
    for (const Device& device : bus.devices)
      if (device.kind == DeviceKind::kJointDrive)
        joints_.emplace_back(world.robot.model.joint_index(device.name), device.name);
  }
}

void TruthWatch::cycle() {
  compare();
  watch_touches();
  watch_faults();
  ++cycle_;
}

void TruthWatch::compare() {
  const plant::Plant& plant = world_->emulator.plant();
  positions_.clear();
  for (const auto& [joint, name] : joints_)
    positions_.push_back(static_cast<float>(plant.joint_position(joint)));
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

void TruthWatch::watch_touches() {
  const std::vector<UnwantedTouch>& touches = judge_->touches();
  for (; touches_ < touches.size(); ++touches_)
    observation_.limits.push_back(
        {fmt::format("{} against {}, N", touches[touches_].link, touches[touches_].other), now(),
         touches[touches_].force, 0});
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
      observation_.moving = joints_[i].second;
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
  const std::vector<std::string>& recovered = judge_->recovered_from();
  for (; recoveries_ < recovered.size(); ++recoveries_) {
    const auto is_it = [&](const ShownEvent& event) {
      return event.text == recovered[recoveries_] && !event.recovered;
    };
    auto found = std::find_if(observation_.events.begin(), observation_.events.end(), is_it);
    if (found == observation_.events.end()) {  // it was cleared in the same cycle in which it was latched
      show(ShownEvent::By::kDriver, now(), device_in(recovered[recoveries_]), recovered[recoveries_]);
      found = observation_.events.end() - 1;
    }
    found->recovered = now();
  }
}

void TruthWatch::warned(std::string_view sentence) {
  show(ShownEvent::By::kWarning, now(), device_in(sentence), std::string(sentence));
}

void TruthWatch::show(ShownEvent::By by, double time, std::string device, std::string text) {
  observation_.events.push_back({by, time, std::move(device), std::move(text), std::nullopt});
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
  for (const UnwantedTouch& touch : judge_->touches())
    observation_.result.touches.push_back(to_string(touch));
  for (const PassedLimit& passed : limits_->passed()) observation_.result.limits.push_back(to_string(passed));
  observation_.limits.insert(observation_.limits.end(), limits_->passed().begin(), limits_->passed().end());
  std::stable_sort(observation_.limits.begin(), observation_.limits.end(),
                   [](const PassedLimit& a, const PassedLimit& b) { return a.time < b.time; });
  find_standstill();
}

}  // namespace walkman::apps
