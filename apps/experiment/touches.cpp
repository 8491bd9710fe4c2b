#include "apps/experiment/touches.h"

#include <algorithm>

#include <fmt/format.h>

#include "urdf/reader/kinematics.h"

namespace walkman::apps {

TouchWatch::TouchWatch(const KnownRobot& robot, std::string object) : object_(std::move(object)) {
  const RobotModel& model = robot.model;
  parts_.resize(model.links.size());
  for (std::size_t i = 0; i < parts_.size(); ++i) parts_[i] = {model.links[i].name, Part::kBody, -1};
  const auto below = [&](const std::string& link) {
    return links_below(model, static_cast<std::size_t>(model.link_index(link)));
  };
  for (std::size_t side = 0; side < robot.description.hands.size(); ++side) {
    const HandParts& hand = robot.description.hands[side];
    for (const std::size_t i : below(hand.force_torque))
      parts_[i] = {model.links[i].name, Part::kPalm, static_cast<int>(side)};
    // The links moved by the hand's motor, or by joints that follow it, are fingers.
    const int motor = model.joint_index(hand.motor);
    for (std::size_t j = 0; j < model.joints.size(); ++j) {
      const Joint& joint = model.joints[j];
      if (static_cast<int>(j) != motor && !(joint.mimic && joint.mimic->joint == hand.motor)) continue;
      for (const std::size_t i : links_below(model, static_cast<std::size_t>(joint.child_link)))
        parts_[i].part = Part::kFinger;
    }
  }
  if (const auto& stance = robot.description.stance) {
    for (const std::string& sensor : stance->feet) {
      // The sensor's frame is fixed to the foot, which is attached to the ankle.
      const Link* foot = &model.links[static_cast<std::size_t>(model.link_index(sensor))];
      while (foot->parent_joint >= 0) {
        const Joint& joint = model.joints[static_cast<std::size_t>(foot->parent_joint)];
        if (joint.type != JointType::kFixed) break;
        foot = &model.links[static_cast<std::size_t>(joint.parent_link)];
      }
      for (const std::size_t i : below(foot->name)) parts_[i].part = Part::kFoot;
    }
  }
  std::sort(parts_.begin(), parts_.end(), [](const auto& a, const auto& b) { return a.link < b.link; });
}

const TouchWatch::NamedPart& TouchWatch::part_of(std::string_view name) const {
  const auto found =
      std::lower_bound(parts_.begin(), parts_.end(), name,
                       [](const NamedPart& part, std::string_view wanted) { return part.link < wanted; });
  return found != parts_.end() && found->link == name ? *found : none_;
}

bool TouchWatch::allowed(const NamedPart& part, std::string_view other, std::string_view phase) const {
  const NamedPart& second = part_of(other);
  if (second.part != Part::kNone) return part.side >= 0 && part.side == second.side;
  if (part.part == Part::kFoot) return true;
  if (part.side < 0) return false;
  if (other == object_) return true;
  return part.part == Part::kFinger && (phase == "grasp" || phase == "lift" || phase == "lower");
}

void TouchWatch::look(const plant::Plant& plant, std::string_view phase) {
  for (const plant::Contact& contact : plant.contacts()) {
    std::string_view link = contact.body_a, other = contact.body_b;
    if (part_of(link).part == Part::kNone) std::swap(link, other);
    const NamedPart& part = part_of(link);
    if (part.part == Part::kNone || allowed(part, other, phase)) continue;
    const bool known = std::any_of(touches_.begin(), touches_.end(), [&](const UnwantedTouch& t) {
      return t.link == link && t.other == other;
    });
    if (known) continue;
    touches_.push_back(
        {std::string(link), std::string(other), std::string(phase), plant.time(), contact.normal_force});
  }
}

std::string to_string(const UnwantedTouch& touch) {
  return fmt::format("{} touched {} with {:.0f} N at {:.2f} s, in {}", touch.link, touch.other, touch.force,
                     touch.time, touch.phase);
}

}  // namespace walkman::apps
