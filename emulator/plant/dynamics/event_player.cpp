#include "emulator/plant/dynamics/event_player.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "urdf/reader/nearest_name.h"

namespace walkman::plant {
namespace {

constexpr long kNotYet = std::numeric_limits<long>::max();

/// The first step that begins at or after `time`.
long step_at(double time, double step) {
  constexpr double kRounding = 1e-6;  // steps
  return static_cast<long>(std::ceil(time / step - kRounding));
}

int pushed_link(const SceneEvent& event, const PushEvent& push, const RobotModel& robot) {
  if (const auto link = robot.find_link(push.link)) return *link;
  std::vector<std::string> names;
  for (const Link& link : robot.links) names.push_back(link.name);
  throw std::runtime_error(fmt::format("{}: events push.link: robot \"{}\" has no link \"{}\"{}", event.where,
                                       robot.name, push.link, did_you_mean(push.link, names)));
}

/// Index of the object named by a weight event; the scene reader has checked that it exists and has the
/// weight.
std::size_t object_of(const Scene& scene, const SceneEvent& event) {
  const auto* move = std::get_if<MoveWeightEvent>(&event.what);
  const std::string& name = move != nullptr ? move->object : std::get<RemoveWeightEvent>(event.what).object;
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    if (scene.objects[i].name == name) return i;
  throw std::runtime_error(fmt::format("{}: there is no object \"{}\"", event.where, name));
}

}  // namespace

EventPlayer::EventPlayer(const Scene& scene, const RobotModel& robot, Multibody& body, double step,
                         std::function<void(std::size_t, const std::vector<AttachedWeight>&)> reweigh)
    : body_(body), step_(step), reweigh_(std::move(reweigh)) {
  for (const SceneObject& object : scene.objects) weights_.push_back(object.weights);
  for (const SceneEvent& event : scene.events) {
    Planned planned{event, event.phase ? kNotYet : step_at(event.at, step),
                    event.phase ? event.phase->occurrence : 0};
    if (const auto* push = std::get_if<PushEvent>(&event.what)) {
      planned.link = pushed_link(event, *push, robot);
    } else if (!std::holds_alternative<SensorFaultEvent>(event.what)) {
      planned.object = object_of(scene, event);
    }
    planned_.push_back(planned);
  }
}

void EventPlayer::begin_phase(std::string_view phase, long step) {
  for (Planned& planned : planned_) {
    if (!planned.event.phase || planned.event.phase->phase != phase || planned.waits_for == 0) continue;
    if (--planned.waits_for == 0) planned.first = step + step_at(planned.event.phase->after, step_);
  }
}

void EventPlayer::change_weights(const Planned& planned) {
  const auto* move = std::get_if<MoveWeightEvent>(&planned.event.what);
  const std::string& name =
      move != nullptr ? move->weight : std::get<RemoveWeightEvent>(planned.event.what).weight;
  std::vector<AttachedWeight>& weights = weights_[planned.object];
  const auto weight = std::find_if(weights.begin(), weights.end(),
                                   [&](const AttachedWeight& candidate) { return candidate.name == name; });
  if (weight == weights.end()) return;  // already removed
  if (move != nullptr) {
    weight->link = move->link;
    weight->X_LA = move->X_LA;
  } else {
    weights.erase(weight);
  }
  reweigh_(planned.object, weights);
}

void EventPlayer::play(long step) {
  for (Planned& planned : planned_) {
    if (planned.done || step < planned.first) continue;
    if (const auto* push = std::get_if<PushEvent>(&planned.event.what)) {
      planned.done = step >= planned.first + std::max(1L, std::lround(push->duration / step_));
      if (planned.done) continue;
      body_.push_at(body_.tree().group_of(planned.link), push->force_W,
                    body_.X_WL(planned.link) * push->p_LP);
    } else if (const auto* fault = std::get_if<SensorFaultEvent>(&planned.event.what)) {
      sensor_faults_.push_back(*fault);
      planned.done = true;
    } else {
      change_weights(planned);
      planned.done = true;
    }
  }
}

}  // namespace walkman::plant
