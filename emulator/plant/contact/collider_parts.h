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

/// What a contact point carries from step to step: how far its surfaces have been shifted against each other
/// while they stick. Static friction holds them there, so a steady load makes nothing creep.
struct Stick {
  btVector3 shift_A{0, 0, 0};    ///< of A against B, in A's frame, m
  btVector3 impulse_A{0, 0, 0};  ///< on A in its frame, N·s: of a soft contact that held, in the last step
};

/// One solid of a body that collides.
struct ColliderPart {
  std::optional<Primitive> primitive;       ///< none: `shape` alone knows what it is
  const btCollisionShape* shape = nullptr;  ///< the same for Bullet's algorithms
  btTransform X_MC;                         ///< of the solid in the body
  Surface surface;
};

/// What two surfaces are together, by Bullet's conventions: friction and restitution are products, rolling
/// and spinning friction each side's with the other's friction, springs in series, dampers added.
[[nodiscard]] Surface pair_of(const Surface& a, const Surface& b);

/// The solids of a body, for ContactDispatcher: hung on Bullet's collision object as its user pointer.
class ColliderParts {
 public:
  /// A part where it is now, and a box around it.
  struct Placed {
    btTransform X_WC;
    btVector3 box_middle;  ///< in W
  };

  void add(const ColliderPart& part);
  /// From now on the parts of `object`; must stay where it is in memory.
  void hang_on(btCollisionObject& object);
  /// Of a collision object that has some; nullptr: none were hung on it.
  [[nodiscard]] static ColliderParts* of(const btCollisionObject& object);

  [[nodiscard]] const std::vector<ColliderPart>& parts() const { return parts_; }
  [[nodiscard]] const btVector3& box_half(std::size_t part) const { return box_half_[part]; }
  /// From the box's middle to its corners, m.
  [[nodiscard]] double box_radius(std::size_t part) const { return box_radius_[part]; }
  /// Poses at the collision object's, reckoned once per `search`.
  [[nodiscard]] const std::vector<Placed>& placed(long search);
  /// How far the point of the boxes that went farthest can have gone by now, m, as a sum over the searches
  /// since `hang_on`: an upper bound.
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

/// A link's collision geometry, with each cylinder that has a sphere of its radius at either end (URDF knows
/// no capsules) as one capsule.
[[nodiscard]] std::vector<Solid> solids_of(const std::vector<LinkGeometry>& collisions);

/// A Bullet shape for a solid, in its frame. Meshes become their convex hull.
[[nodiscard]] std::unique_ptr<btCollisionShape> make_shape(const Solid& solid);

}  // namespace walkman::plant
