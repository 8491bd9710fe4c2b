#include "adaptation/motion/body_guard.h"

#include <algorithm>
#include <limits>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "adaptation/motion/whole_body_ik.h"
#include "urdf/reader/kinematics.h"

namespace walkman::motion {
namespace {

constexpr double kFingerSlack = 0.001;  // m, for a hand that ends slightly off its goal

/// Returns a number for each link that it shares with the links that do not move relative to it: considering
/// only the joints in `moving`, or, without it, all joints that are not fixed.
std::vector<int> rigid_groups(const KinematicTree& kinematics, const std::vector<int>* moving) {
  const RobotModel& model = kinematics.model();
  std::vector<int> group(model.links.size());
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    group[i] = static_cast<int>(i);
    if (model.links[i].parent_joint < 0) continue;
    const Joint& joint = model.joints[static_cast<std::size_t>(model.links[i].parent_joint)];
    bool moves = joint.type != JointType::kFixed;
    if (moves && moving != nullptr) {
      const int dof = kinematics.dof_of(joint.name);
      moves = std::find(moving->begin(), moving->end(), dof) != moving->end();
    }
    if (!moves) group[i] = group[static_cast<std::size_t>(joint.parent_link)];
  }
  return group;
}

/// Whether a joint outside the degrees of freedom moves the link relative to the rigid body of `hand`.
bool is_finger(const KinematicTree& kinematics, const std::vector<int>& solid, int link, int hand) {
  const RobotModel& model = kinematics.model();
  const int palm = solid[static_cast<std::size_t>(hand)];
  bool passive = false;
  for (int at = link; at >= 0;) {
    if (solid[static_cast<std::size_t>(at)] == palm) return passive;
    const int carrier = model.links[static_cast<std::size_t>(at)].parent_joint;
    if (carrier < 0) return false;
    const Joint& joint = model.joints[static_cast<std::size_t>(carrier)];
    if (joint.type != JointType::kFixed) {
      if (kinematics.dof_of(joint.name) >= 0) return false;
      passive = true;
    }
    at = joint.parent_link;
  }
  return false;
}

}  // namespace

BodyGuard::BodyGuard(const KinematicTree& kinematics, const std::vector<int>& moving, bool base_moves,
                     int shoulder, const std::string& hand_link, const std::string& twist,
                     const std::vector<std::pair<std::string, std::string>>& disabled,
                     const GuardMargins& margins)
    : kinematics_(&kinematics),
      shapes_(body_shapes(kinematics.model())),
      X_WS_(shapes_.size()),
      margins_(margins) {
  const RobotModel& model = kinematics.model();
  const std::vector<int> moved = rigid_groups(kinematics, &moving);
  const std::vector<int> solid = rigid_groups(kinematics, nullptr);
  const auto solid_of = [&](int link) { return solid[static_cast<std::size_t>(link)]; };
  std::set<std::pair<int, int>> excused;  // pairs of rigid bodies
  for (const auto& [a, b] : disabled)
    excused.insert(std::minmax(solid_of(model.link_index(a)), solid_of(model.link_index(b))));
  for (const Joint& joint : model.joints)
    excused.insert(std::minmax(solid_of(joint.parent_link), solid_of(joint.child_link)));

  const int hand = model.link_index(hand_link);
  const std::vector<std::size_t> arm = links_below(model, static_cast<std::size_t>(shoulder));
  std::vector<std::size_t> on_twist;
  if (!twist.empty()) {
    twist_ = model.joint_index(twist);
    const int carried = model.joints[static_cast<std::size_t>(twist_)].child_link;
    on_twist = links_below(model, static_cast<std::size_t>(carried));
  }
  for (std::size_t i = 0; i < shapes_.size(); ++i) {
    is_turned_.push_back(std::find(on_twist.begin(), on_twist.end(),
                                   static_cast<std::size_t>(shapes_[i].link)) != on_twist.end());
    extents_.push_back(shapes_[i].extent());
    const int link = shapes_[i].link;
    of_arm_.push_back(std::find(arm.begin(), arm.end(), static_cast<std::size_t>(link)) != arm.end());
    const bool moves = base_moves || moved[static_cast<std::size_t>(link)] != moved.front();
    if (moves)
      (is_finger(kinematics, solid, link, hand) ? fingers_ : against_obstacles_)
          .push_back(static_cast<int>(i));
    for (std::size_t j = i + 1; j < shapes_.size(); ++j) {
      const int other = shapes_[j].link;
      if (moved[static_cast<std::size_t>(link)] == moved[static_cast<std::size_t>(other)]) continue;
      if (excused.contains(std::minmax(solid_of(link), solid_of(other)))) continue;
      pairs_.push_back({static_cast<int>(i), static_cast<int>(j)});
    }
  }
  update();
}

void BodyGuard::add(const Nearness& nearness) noexcept {
  if (near_count_ == kMostNear) {
    if (nearness.gap.distance >= near_[near_count_ - 1].gap.distance) return;
    --near_count_;
  }
  std::size_t place = near_count_++;
  for (; place > 0 && near_[place - 1].gap.distance > nearness.gap.distance; --place)
    near_[place] = near_[place - 1];
  near_[place] = nearness;
}

void BodyGuard::update(bool with_fingers) noexcept {
  near_count_ = 0;
  own_clearance_ = kFarthest;
  obstacle_clearance_ = obstacles_.empty() ? std::numeric_limits<double>::infinity() : kFarthest;
  for (std::size_t i = 0; i < shapes_.size(); ++i)
    X_WS_[i] = kinematics_->X_WL(shapes_[i].link) * shapes_[i].X_LS;
  for (Pair& pair : pairs_) look_at(pair);
  // Links move little between two updates: the pairs that are near now are the first to fill the list next
  // time, and the direction that last separated them shows most others to be farther.
  const double listed = enough();
  std::size_t front = 0;
  for (Pair& pair : pairs_)
    if (pair.distance <= listed) std::swap(pair, pairs_[front++]);
  for (const auto* watched : {&against_obstacles_, &fingers_}) {
    const bool fingers = watched == &fingers_;
    if (fingers && !with_fingers) continue;
    for (const int i : *watched) {
      for (std::size_t k = 0; k < obstacles_.size(); ++k) {
        const Nearness found{gap_to(k, i, X_WS_[static_cast<std::size_t>(i)]), i, -1, static_cast<int>(k)};
        if (found.gap.distance >= kFarthest) continue;
        if (!fingers) obstacle_clearance_ = std::min(obstacle_clearance_, found.gap.distance);
        add(found);
      }
    }
  }
}

void BodyGuard::look_at(Pair& pair) noexcept {
  const auto a = static_cast<std::size_t>(pair.shape), b = static_cast<std::size_t>(pair.other);
  const double within = extents_[a] + extents_[b] + kFarthest;
  pair.distance = std::numeric_limits<double>::infinity();
  if ((X_WS_[a].translation() - X_WS_[b].translation()).squaredNorm() > within * within) return;
  if (apart_along(shapes_[a], X_WS_[a], shapes_[b], X_WS_[b], pair.n_W) >= enough()) return;
  const Nearness found{separation(shapes_[a], X_WS_[a], shapes_[b], X_WS_[b], enough()), pair.shape,
                       pair.other, -1};
  pair.n_W = found.gap.n_W;
  pair.distance = found.gap.distance;
  if (pair.distance >= enough()) return;
  own_clearance_ = std::min(own_clearance_, pair.distance);
  add(found);
}

Separation BodyGuard::gap_to(std::size_t obstacle, int shape, const Eigen::Isometry3d& X_WS) const noexcept {
  const auto a = static_cast<std::size_t>(shape);
  const ConvexPrism& prism = obstacles_[obstacle].prism;
  Separation gap;
  gap.distance = kFarthest;
  if (prism.distance(X_WS.translation()) > extents_[a] + kFarthest) return gap;
  gap.distance = -std::numeric_limits<double>::infinity();
  // The face that the whole solid is farthest outside of.
  for (const ConvexPrism::Face& face : prism.faces()) {
    const Eigen::Vector3d n_S = X_WS.linear().transpose() * face.n_W;
    const double distance = face.n_W.dot(X_WS.translation()) - face.offset - shapes_[a].reach(-n_S);
    if (distance <= gap.distance) continue;
    gap.distance = distance;
    gap.n_W = face.n_W;
  }
  if (gap.distance < kFarthest) gap.p_WA = X_WS * shapes_[a].foremost_S(X_WS.linear().transpose() * -gap.n_W);
  return gap;
}

double BodyGuard::finger_margin(const Eigen::Isometry3d& X_WW) const noexcept {
  double nearest = margins_.arm + kFingerSlack;
  for (const int i : fingers_) {
    const Eigen::Isometry3d X_WS = X_WW * X_WS_[static_cast<std::size_t>(i)];
    for (std::size_t k = 0; k < obstacles_.size(); ++k)
      nearest = std::min(nearest, gap_to(k, i, X_WS).distance);
  }
  return nearest - kFingerSlack;
}

void BodyGuard::keep_apart(WholeBodyIk& ik, double finger_margin, double gain) const noexcept {
  for (const Nearness& nearness : near()) {
    const Separation& gap = nearness.gap;
    const bool finger = std::find(fingers_.begin(), fingers_.end(), nearness.shape) != fingers_.end();
    const double of_link = of_arm_[static_cast<std::size_t>(nearness.shape)] ? margins_.arm : margins_.idle;
    const double off_obstacle = finger ? finger_margin : of_link;
    const double margin = nearness.other >= 0 ? margins_.own + turned(nearness) : off_obstacle;
    const double approach = std::max(0.0, gain * (gap.distance - margin));
    const int link = shapes_[static_cast<std::size_t>(nearness.shape)].link;
    const Eigen::Vector3d p_LP = kinematics_->X_WL(link).inverse(Eigen::Isometry) * gap.p_WA;
    if (nearness.other < 0) {
      ik.keep_clear(link, p_LP, gap.n_W, approach);
      continue;
    }
    const int other = shapes_[static_cast<std::size_t>(nearness.other)].link;
    const Eigen::Vector3d p_KQ = kinematics_->X_WL(other).inverse(Eigen::Isometry) * gap.p_WB;
    ik.keep_apart(link, p_LP, other, p_KQ, gap.n_W, approach);
  }
}

double BodyGuard::turned(const Nearness& nearness) const noexcept {
  if (is_turned_[static_cast<std::size_t>(nearness.shape)] ==
      is_turned_[static_cast<std::size_t>(nearness.other)])
    return 0;
  const Joint& joint = kinematics_->model().joints[static_cast<std::size_t>(twist_)];
  const Eigen::Isometry3d& X_WT = kinematics_->X_WL(joint.child_link);
  const Eigen::Vector3d axis_W = X_WT.linear() * joint.axis;
  return margins_.turn * std::abs(nearness.gap.n_W.dot(axis_W.cross(nearness.gap.p_WA - X_WT.translation())));
}

std::string BodyGuard::describe(const Nearness& nearness) const {
  const auto name = [this](int shape) -> const std::string& {
    return kinematics_->model()
        .links[static_cast<std::size_t>(shapes_[static_cast<std::size_t>(shape)].link)]
        .name;
  };
  if (nearness.other < 0)
    return fmt::format("{} and {}", name(nearness.shape),
                       obstacles_[static_cast<std::size_t>(nearness.obstacle)].name);
  return fmt::format("{} and the robot's own {}", name(nearness.shape), name(nearness.other));
}

}  // namespace walkman::motion
