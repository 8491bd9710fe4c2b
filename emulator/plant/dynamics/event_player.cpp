#include "emulator/plant/dynamics/event_player.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "urdf/reader/nearest_name.h"

namespace walkman::plant {
namespace {

/// The first step that begins at or after `time`.
long step_at(double time, double step) {
  constexpr double kRounding = 1e-6;  // steps
  return static_cast<long>(std::ceil(time / step - kRounding));
}

int pushed_link(const Scene& scene, const SceneEvent& event, const PushEvent& push, const RobotModel& robot) {
  if (const auto link = robot.find_link(push.link)) return *link;
  std::vector<std::string> names;
  for (const Link& link : robot.links) names.push_back(link.name);
  throw std::runtime_error(fmt::format("{}:{}: events push.link: robot \"{}\" has no link \"{}\"{}",
                                       scene.file.string(), event.line, robot.name, push.link,
                                       did_you_mean(push.link, names)));
}

}  // namespace

EventPlayer::EventPlayer(const Scene& scene, const RobotModel& robot, Multibody& body, double step,
                         std::function<void(std::size_t, const std::vector<AttachedWeight>&)> reweigh)
    : body_(body), reweigh_(std::move(reweigh)) {
  for (const SceneObject& object : scene.objects) weights_.push_back(object.weights);
  for (const SceneEvent& event : scene.events) {
    const long first = step_at(event.at, step);
    if (const auto* push = std::get_if<PushEvent>(&event.what)) {
      const long steps = std::max(1L, std::lround(push->duration / step));
      pushes_.push_back(
          {first, first + steps, pushed_link(scene, event, *push, robot), push->force_W, push->p_LP});
    } else {
      add_change(scene, first, event);
    }
  }
}

void EventPlayer::add_change(const Scene& scene, long step, const SceneEvent& event) {
  const auto* move = std::get_if<MoveWeightEvent>(&event.what);
  const auto* removal = std::get_if<RemoveWeightEvent>(&event.what);
  const std::string& name = move != nullptr ? move->object : removal->object;
  const std::string& weight_name = move != nullptr ? move->weight : removal->weight;
  const auto found = std::find_if(scene.objects.begin(), scene.objects.end(),
                                  [&](const SceneObject& candidate) { return candidate.name == name; });
  if (found == scene.objects.end())
    throw std::runtime_error(
        fmt::format("{}:{}: there is no object \"{}\"", scene.file.string(), event.line, name));
  const auto object = static_cast<std::size_t>(found - scene.objects.begin());
  std::vector<AttachedWeight>& weights = weights_[object];
  const auto weight = std::find_if(weights.begin(), weights.end(), [&](const AttachedWeight& candidate) {
    return candidate.name == weight_name;
  });
  if (weight == weights.end())
    throw std::runtime_error(fmt::format("{}:{}: object \"{}\" has no weight \"{}\"", scene.file.string(),
                                         event.line, name, weight_name));
  if (move != nullptr) {
    weight->position = move->position;
  } else {
    weights.erase(weight);
  }
  changes_.push_back({step, object, weights});
}

void EventPlayer::play(long step) {
  for (; next_change_ < changes_.size() && changes_[next_change_].step <= step; ++next_change_)
    reweigh_(changes_[next_change_].object, changes_[next_change_].weights);
  for (const Push& push : pushes_) {
    if (step < push.first || step >= push.end) continue;
    body_.push_at(body_.tree().group_of(push.link), push.force_W, body_.X_WL(push.link) * push.p_LP);
  }
}

}  // namespace walkman::plant
