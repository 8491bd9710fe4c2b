#include "emulator/plant/dynamics/hoist.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

#include "urdf/reader/nearest_name.h"

namespace walkman::plant {
namespace {

constexpr double kAbove = 1.5;   // m, of the anchor above the knot if the scene gives no anchor
constexpr double kSlack = 0.05;  // m, if the scene gives no length

int rope_link(const Scene& scene, const RobotModel& robot) {
  if (const auto link = robot.find_link(scene.rope.link)) return *link;
  std::vector<std::string> names;
  for (const Link& link : robot.links) names.push_back(link.name);
  const std::string place = !scene.rope.where.empty()
                                ? fmt::format("{}: robot.base.rope.link", scene.rope.where)
                                : fmt::format("{}: robot.base.rope", scene.file.string());
  throw std::runtime_error(fmt::format("{}: robot \"{}\" has no link \"{}\"{}", place, robot.name,
                                       scene.rope.link, did_you_mean(scene.rope.link, names)));
}

}  // namespace

Hoist::Hoist(const Scene& scene, const RobotModel& robot, Multibody& body)
    : body_(body),
      link_(rope_link(scene, robot)),
      group_(body.tree().group_of(link_)),
      p_LE_(scene.rope.p_LE),
      length_(0) {
  const Eigen::Vector3d p_WE = body_.X_WL(link_) * p_LE_;
  p_WA_ = scene.rope.p_WA.value_or(p_WE + Eigen::Vector3d(0, 0, kAbove));
  length_ = scene.rope.length.value_or((p_WA_ - p_WE).norm() + kSlack);
}

void Hoist::apply() {
  const Eigen::Vector3d p_WE = body_.X_WL(link_) * p_LE_;
  const Eigen::Vector3d to_anchor = p_WA_ - p_WE;
  const double distance = to_anchor.norm();
  tension_ = 0;
  if (distance <= length_) return;
  const Eigen::Vector3d up = to_anchor / distance;
  const double speed = -up.dot(body_.velocity_at(group_, p_WE));
  tension_ = std::max(0.0, kStiffness * (distance - length_) + kDamping * speed);
  body_.push_at(group_, tension_ * up, p_WE);
}

}  // namespace walkman::plant
