#include "emulator/plant/contact/collider_parts.h"

#include <algorithm>
#include <cmath>

#include <btBulletCollisionCommon.h>

#include "emulator/plant/contact/bullet_types.h"

namespace walkman::plant {
namespace {

constexpr double kSame = 1e-6;    // m
constexpr double kMargin = 1e-3;  // m, of GJK; larger margins round a cylinder's edge and shift contacts

/// Index of the sphere of this radius at a point; −1 if there is none.
int sphere_at(const std::vector<Solid>& solids, const Eigen::Vector3d& p_L, double radius) {
  const auto found = std::find_if(solids.begin(), solids.end(), [&](const Solid& solid) {
    return solid.primitive && solid.primitive->kind == Primitive::Kind::kSphere &&
           std::abs(solid.primitive->radius - radius) < kSame &&
           (solid.X_LC.translation() - p_L).norm() < kSame;
  });
  return found == solids.end() ? -1 : static_cast<int>(found - solids.begin());
}

}  // namespace

Surface pair_of(const Surface& a, const Surface& b) {
  const bool both = a.stiffness > 0 && b.stiffness > 0;
  return {a.friction * b.friction,
          a.rolling_friction * b.friction + b.rolling_friction * a.friction,
          a.spinning_friction * b.friction + b.spinning_friction * a.friction,
          a.restitution * b.restitution,
          both ? 1 / (1 / a.stiffness + 1 / b.stiffness) : a.stiffness + b.stiffness,
          a.damping + b.damping};
}

void ColliderParts::add(const ColliderPart& part) {
  btVector3 low, high;
  part.shape->getAabb(btTransform::getIdentity(), low, high);
  parts_.push_back(part);
  box_middle_C_.push_back((high + low) / 2);
  box_half_.push_back((high - low) / 2);
  box_radius_.push_back(box_half_.back().length());
  reach_ = std::max(reach_, (part.X_MC * box_middle_C_.back()).length() + box_radius_.back());
  placed_.emplace_back();
}

void ColliderParts::hang_on(btCollisionObject& object) {
  object_ = &object;
  before_ = object.getWorldTransform();
  object.setUserPointer(this);
}

ColliderParts* ColliderParts::of(const btCollisionObject& object) {
  return static_cast<ColliderParts*>(object.getUserPointer());
}

const std::vector<ColliderParts::Placed>& ColliderParts::placed(long search) {
  if (placed_search_ == search) return placed_;
  placed_search_ = search;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    placed_[i].X_WC = object_->getWorldTransform() * parts_[i].X_MC;
    placed_[i].box_middle = placed_[i].X_WC * box_middle_C_[i];
  }
  return placed_;
}

double ColliderParts::travelled(long search) {
  if (travelled_search_ == search) return travelled_;
  travelled_search_ = search;
  const btTransform& now = object_->getWorldTransform();
  double squares = 0;
  for (int i = 0; i < 3; ++i) squares += (now.getBasis()[i] - before_.getBasis()[i]).length2();
  const double moved = (now.getOrigin() - before_.getOrigin()).length();
  if (squares == 0 && moved == 0) return travelled_;
  // The spectral norm of the difference of two rotation matrices is sqrt(1/2) of its Frobenius norm.
  travelled_ += moved + std::sqrt(squares / 2) * reach_;
  before_ = now;
  return travelled_;
}

std::vector<Solid> solids_of(const std::vector<LinkGeometry>& collisions) {
  std::vector<Solid> solids;
  solids.reserve(collisions.size());
  for (const LinkGeometry& geometry : collisions)
    solids.push_back({geometry.X_LG, primitive_of(geometry), std::get_if<MeshShape>(&geometry.shape)});
  std::vector<bool> joined(solids.size(), false);
  for (Solid& solid : solids) {
    if (!solid.primitive || solid.primitive->kind != Primitive::Kind::kCylinder) continue;
    const Eigen::Vector3d arm = solid.X_LC.linear().col(2) * solid.primitive->half_length;
    const int one = sphere_at(solids, solid.X_LC.translation() + arm, solid.primitive->radius);
    const int other = sphere_at(solids, solid.X_LC.translation() - arm, solid.primitive->radius);
    if (one < 0 || other < 0) continue;
    solid.primitive->kind = Primitive::Kind::kCapsule;
    joined[static_cast<std::size_t>(one)] = joined[static_cast<std::size_t>(other)] = true;
  }
  std::vector<Solid> left;
  for (std::size_t i = 0; i < solids.size(); ++i) {
    if (!joined[i]) left.push_back(solids[i]);
  }
  return left;
}

std::unique_ptr<btCollisionShape> make_shape(const Solid& solid) {
  std::unique_ptr<btConvexShape> shape;
  if (solid.mesh != nullptr) {
    auto hull = std::make_unique<btConvexHullShape>();
    for (const Eigen::Vector3d& v : solid.mesh->vertices) hull->addPoint(to_bullet(v), false);
    hull->optimizeConvexHull();
    hull->recalcLocalAabb();
    hull->initializePolyhedralFeatures();
    shape = std::move(hull);
  } else {
    const Primitive& p = solid.primitive.value();
    switch (p.kind) {
      case Primitive::Kind::kSphere:
        return std::make_unique<btSphereShape>(p.radius);  // the margin is its radius
      case Primitive::Kind::kCapsule:
        return std::make_unique<btCapsuleShapeZ>(p.radius, 2 * p.half_length);
      case Primitive::Kind::kCylinder:
        shape = std::make_unique<btCylinderShapeZ>(btVector3(p.radius, p.radius, p.half_length));
        break;
      case Primitive::Kind::kBox: {
        auto box = std::make_unique<btBoxShape>(p.half);
        box->initializePolyhedralFeatures();  // for contacts of its faces with a mesh's
        shape = std::move(box);
        break;
      }
    }
  }
  shape->setMargin(kMargin);
  return shape;
}

}  // namespace walkman::plant
