#pragma once

#include <map>
#include <string>
#include <vector>

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include "emulator/plant/dynamics/rigid_tree.h"

namespace walkman::plant {

/// Why two bodies of the robot are allowed to pass through each other.
enum class Excuse {
  kNone,            ///< they collide
  kAdjacent,        ///< a joint joins them
  kCompoundJoint,   ///< two joints close together join them, as in a wrist
  kSameHand,        ///< parts of one adaptive hand
  kTouchesAtZero,   ///< their shapes touch when every joint is at zero
  kTouchesAtStart,  ///< their shapes touch in the posture the robot starts in
};

[[nodiscard]] const char* to_string(Excuse excuse);

/// Two bodies of a tree that do not collide.
struct ExcusedPair {
  int group_a = 0, group_b = 0;  ///< indices of the tree's groups, a < b
  Excuse excuse = Excuse::kNone;
};

/// Which bodies of a robot's tree may touch, generated from its geometry.
///
/// The shapes enclose links more or less tightly, so some overlap where the real links do not. Pairs that
/// touch (within 1 mm) at zero or in `start` are excused; so are neighbours, next-but-one neighbours whose
/// two joints are less than 10 cm apart (the boxes of a wrist would take away half of its travel), and the
/// parts of one hand (everything below one joint at which the tree is cut for a wrist's sensor). Every other
/// pair collides.
class SelfCollision {
 public:
  /// `start`: joint values by name, as `load_posture` gives them.
  SelfCollision(const RobotModel& model, const RigidTree& tree, const std::map<std::string, double>& start);

  [[nodiscard]] Excuse excuse(int group_a, int group_b) const {
    return table_[static_cast<std::size_t>(group_a) * count_ + static_cast<std::size_t>(group_b)];
  }
  /// All excused pairs of bodies that have shapes, sorted by a, then b.
  [[nodiscard]] const std::vector<ExcusedPair>& excused() const { return excused_; }

 private:
  void excuse(int a, int b, Excuse why);

  std::size_t count_;
  std::vector<Excuse> table_;  // count_ × count_, symmetric
  std::vector<ExcusedPair> excused_;
};

/// Bullet's pair filter: groups and masks, and the table for two links of one multibody. Called only when two
/// boxes begin to overlap, so it adds no cost to a step.
class SelfCollisionFilter : public btOverlapFilterCallback {
 public:
  explicit SelfCollisionFilter(const SelfCollision& table) : table_(&table) {}
  bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override;

 private:
  const SelfCollision* table_;
};

}  // namespace walkman::plant
