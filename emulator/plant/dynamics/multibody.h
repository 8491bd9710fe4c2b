#pragma once

#include <memory>
#include <vector>

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include "emulator/plant/contact/collider_parts.h"
#include "emulator/plant/dynamics/rigid_tree.h"

class btMultiBodyDynamicsWorld;

namespace walkman::plant {

/// Collision filter groups; a mask is the sum of the groups that a body collides with.
enum CollisionGroup : int { kObjectGroup = 1, kFixedGroup = 2, kRobotGroup = 4 };

/// A URDF tree as one Bullet multibody. Owns the multibody, its colliders and their shapes; removes them from
/// the world when destroyed.
///
/// Every link gets a collider, which holds the link's pose at the end of the step; if the model gives no
/// shape, it is a 1 cm sphere that collides with nothing. Bullet's link indices are the tree's group indices
/// minus one.
class Multibody {
 public:
  /// X_WR: pose of the model's root link. `world` must outlive this.
  Multibody(btMultiBodyDynamicsWorld& world, const RobotModel& model, RigidTree tree, bool fixed_base,
            const Eigen::Isometry3d& X_WR, int collision_group, int collision_mask);
  ~Multibody();
  Multibody(const Multibody&) = delete;
  Multibody& operator=(const Multibody&) = delete;

  [[nodiscard]] btMultiBody& bullet() { return *body_; }
  [[nodiscard]] const btMultiBody& bullet() const { return *body_; }
  [[nodiscard]] const RigidTree& tree() const { return tree_; }

  /// Pose of a URDF link in the world.
  [[nodiscard]] Eigen::Isometry3d X_WL(int link) const;
  /// Pose of a group's M frame in the world.
  [[nodiscard]] Eigen::Isometry3d X_WM(int group) const;
  /// Bullet's link index of the group carried by a moving URDF joint.
  [[nodiscard]] int bullet_link(int joint) const;
  /// Velocity of a point fixed to a group, in W, m/s; `p_WP` is where it is now.
  [[nodiscard]] Eigen::Vector3d velocity_at(int group, const Eigen::Vector3d& p_WP) const;

  /// Adds a force (N) on a group for the coming step; it acts at `p_WP`.
  void push_at(int group, const Eigen::Vector3d& force_W, const Eigen::Vector3d& p_WP);

  /// Brings link and collider poses in line with joint positions set from outside.
  void update_poses();

 private:
  void set_up_links(const RobotModel& model);
  void add_colliders(const RobotModel& model, int group, int mask);

  btMultiBodyDynamicsWorld& world_;
  RigidTree tree_;
  std::vector<int> bullet_link_of_joint_;
  std::unique_ptr<btMultiBody> body_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btMultiBodyLinkCollider>> colliders_;
  std::vector<std::unique_ptr<ColliderParts>> parts_;  // one per collider
};

}  // namespace walkman::plant
