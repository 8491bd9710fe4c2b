#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <LinearMath/btVector3.h>

#include "emulator/plant/contact/primitive.h"
#include "urdf/reader/robot_model.h"

class btCollisionObject;

namespace walkman::plant {

/// State that a contact point keeps from step to step: how far its surfaces have shifted relative to each
/// other while they stick. Static friction holds them there, so nothing creeps under a steady load.
struct Stick {
  btVector3 shift_A{0, 0, 0};    ///< of A relative to B, in A's frame, m
  btVector3 impulse_A{0, 0, 0};  ///< on A in its frame, N·s: of a soft contact that stuck, in the last step
};

/// One solid of a body that collides.
struct ColliderPart {
  std::optional<Primitive> primitive;       ///< none: described by `shape` alone
  const btCollisionShape* shape = nullptr;  ///< the same solid for Bullet's algorithms
  btTransform X_MC;                         ///< of the solid in the body
  Surface surface;
};

/// Combined properties of two surfaces by Bullet's conventions: friction and restitution are products;
/// rolling and spinning friction are the sums of each side's times the other's friction; springs act in
/// series; dampers add.
[[nodiscard]] Surface pair_of(const Surface& a, const Surface& b);

/// The solids of a body, for ContactDispatcher: attached to Bullet's collision object as its user pointer.
class ColliderParts {
 public:
  /// Present pose of a part and of the box around it.
  struct Placed {
    btTransform X_WC;
    btVector3 box_middle;  ///< in W
  };

  void add(const ColliderPart& part);
  /// Attaches these parts to `object`; this must not move in memory afterwards.
  void hang_on(btCollisionObject& object);
  /// Returns the parts of a collision object; nullptr if none are attached.
  [[nodiscard]] static ColliderParts* of(const btCollisionObject& object);

  [[nodiscard]] const std::vector<ColliderPart>& parts() const { return parts_; }
  [[nodiscard]] const btVector3& box_half(std::size_t part) const { return box_half_[part]; }
  /// From the box's centre to its corners, m.
  [[nodiscard]] double box_radius(std::size_t part) const { return box_radius_[part]; }
  /// Parts placed at the collision object's pose, computed once per `search`.
  [[nodiscard]] const std::vector<Placed>& placed(long search);
  /// Upper bound on how far any point of the boxes has travelled by now, m, summed over the searches since
  /// `hang_on`.
  [[nodiscard]] double travelled(long search);

 private:
  btCollisionObject* object_ = nullptr;
  double travelled_ = 0;
  long travelled_search_ = -1;
  double reach_ = 0;  // from the object's origin to the farthest corner of a box, m
  btTransform before_ = btTransform::getIdentity();
  std::vector<ColliderPart> parts_;
  std::vector<btVector3> box_middle_C_, box_half_;
  std::vector<double> box_radius_;
  std::vector<Placed> placed_;
  long placed_search_ = -1;
};

/// A solid of a link: a primitive or a mesh.
struct Solid {
  Eigen::Isometry3d X_LC = Eigen::Isometry3d::Identity();
  std::optional<Primitive> primitive;
  const MeshShape* mesh = nullptr;
};

/// A link's collision geometry, in which each cylinder with a sphere of its radius at either end (URDF has no
/// capsules) becomes one capsule.
[[nodiscard]] std::vector<Solid> solids_of(const std::vector<LinkGeometry>& collisions);

/// A Bullet shape for a solid, in its frame. Meshes become their convex hull.
[[nodiscard]] std::unique_ptr<btCollisionShape> make_shape(const Solid& solid);

}  // namespace walkman::plant
