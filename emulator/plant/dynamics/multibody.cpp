#include "emulator/plant/dynamics/multibody.h"

#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>

#include "emulator/plant/contact/bullet_types.h"

namespace walkman::plant {
namespace {

constexpr double kCollisionMargin = 0.001;  // m

}  // namespace

Multibody::Multibody(btMultiBodyDynamicsWorld& world, const RobotModel& model, RigidTree tree,
                     bool fixed_base, const Eigen::Isometry3d& X_WR, int collision_group, int collision_mask)
    : world_(world), tree_(std::move(tree)), bullet_link_of_joint_(model.joints.size(), -1) {
  const RigidBodyGroup& base = tree_.groups().front();
  body_ = std::make_unique<btMultiBody>(static_cast<int>(tree_.groups().size()) - 1, base.mass,
                                        to_bullet(base.inertia), fixed_base, false);
  set_up_links(model);
  body_->finalizeMultiDof();
  body_->setLinearDamping(0);
  body_->setAngularDamping(0);
  body_->setCanSleep(false);
  body_->setHasSelfCollision(false);
  body_->setMaxCoordinateVelocity(1e4);  // the default of 100 clamps joint speeds silently
  body_->setBaseWorldTransform(to_bullet(Eigen::Isometry3d(X_WR * base.X_RM)));
  world_.addMultiBody(body_.get());
  add_colliders(model, collision_group, collision_mask);
}

Multibody::~Multibody() {
  for (const auto& collider : colliders_) world_.removeCollisionObject(collider.get());
  world_.removeMultiBody(body_.get());
}

void Multibody::set_up_links(const RobotModel& model) {
  for (std::size_t g = 1; g < tree_.groups().size(); ++g) {
    const RigidBodyGroup& group = tree_.groups()[g];
    const Joint& joint = model.joints[static_cast<std::size_t>(group.joint)];
    const int index = static_cast<int>(g) - 1;
    bullet_link_of_joint_[static_cast<std::size_t>(group.joint)] = index;
    // Frames: P parent link, J joint frame = child link at zero, M principal frames of both groups.
    const Eigen::Isometry3d X_MpJ = tree_.X_ML(joint.parent_link) * joint.X_PJ;
    const Eigen::Isometry3d X_MJ = group.X_RM.inverse();
    const Eigen::Matrix3d R_MMp = (X_MJ * X_MpJ.inverse()).linear();
    btQuaternion rotation;
    to_bullet(R_MMp).getRotation(rotation);
    const btVector3 pivot = to_bullet(Eigen::Vector3d(X_MpJ.translation()));
    const btVector3 com = to_bullet(Eigen::Vector3d(-X_MJ.translation()));
    const btVector3 axis = to_bullet(Eigen::Vector3d(X_MJ.linear() * joint.axis));
    const btVector3 inertia = to_bullet(group.inertia);
    if (!group.moves) {
      body_->setupFixed(index, group.mass, inertia, group.parent - 1, rotation, pivot, com, true);
    } else if (joint.type == JointType::kPrismatic) {
      body_->setupPrismatic(index, group.mass, inertia, group.parent - 1, rotation, axis, pivot, com, true);
    } else {
      body_->setupRevolute(index, group.mass, inertia, group.parent - 1, rotation, axis, pivot, com, true);
    }
  }
}

void Multibody::add_colliders(const RobotModel& model, int group, int mask) {
  for (std::size_t g = 0; g < tree_.groups().size(); ++g) {
    auto compound = std::make_unique<btCompoundShape>();
    compound->setMargin(kCollisionMargin);
    auto parts = std::make_unique<ColliderParts>();
    for (const int link : tree_.groups()[g].links) {
      for (const Solid& solid : solids_of(model.links[static_cast<std::size_t>(link)].collisions)) {
        auto shape = make_shape(solid);
        const btTransform X_MC = to_bullet(Eigen::Isometry3d(tree_.X_ML(link) * solid.X_LC));
        compound->addChildShape(X_MC, shape.get());
        parts->add({solid.primitive, shape.get(), X_MC, model.links[static_cast<std::size_t>(link)].surface});
        shapes_.push_back(std::move(shape));
      }
    }
    const bool empty = compound->getNumChildShapes() == 0;
    if (empty) {
      shapes_.push_back(std::make_unique<btSphereShape>(0.01));
    } else {
      shapes_.push_back(std::move(compound));
    }
    const int index = static_cast<int>(g) - 1;
    auto collider = std::make_unique<btMultiBodyLinkCollider>(body_.get(), index);
    collider->setCollisionShape(shapes_.back().get());
    collider->setActivationState(DISABLE_DEACTIVATION);
    if (!empty) parts->hang_on(*collider);
    parts_.push_back(std::move(parts));
    world_.addCollisionObject(collider.get(), empty ? 0 : group, empty ? 0 : mask);
    if (index < 0) {
      body_->setBaseCollider(collider.get());
    } else {
      body_->getLink(index).m_collider = collider.get();
    }
    colliders_.push_back(std::move(collider));
  }
  update_poses();
}

void Multibody::update_poses() {
  btAlignedObjectArray<btQuaternion> rotations;
  btAlignedObjectArray<btVector3> positions;
  body_->forwardKinematics(rotations, positions);
  body_->updateCollisionObjectWorldTransforms(rotations, positions);
}

Eigen::Isometry3d Multibody::X_WM(int group) const {
  // Bullet's cached link transforms are those at the start of the step; the colliders have the poses at its
  // end.
  return from_bullet(colliders_[static_cast<std::size_t>(group)]->getWorldTransform());
}

Eigen::Isometry3d Multibody::X_WL(int link) const { return X_WM(tree_.group_of(link)) * tree_.X_ML(link); }

int Multibody::bullet_link(int joint) const { return bullet_link_of_joint_[static_cast<std::size_t>(joint)]; }

Eigen::Vector3d Multibody::velocity_at(int group, const Eigen::Vector3d& p_WP) const {
  const btMultiBody& mb = *body_;
  Eigen::Vector3d velocity = from_bullet(mb.getBaseVel());
  velocity += from_bullet(mb.getBaseOmega()).cross(p_WP - X_WM(0).translation());
  for (int g = group; g > 0; g = tree_.groups()[static_cast<std::size_t>(g)].parent) {
    const btMultibodyLink& link = mb.getLink(g - 1);
    if (link.m_dofCount == 0) continue;
    const Eigen::Isometry3d X_WG = X_WM(g);
    const double rate = mb.getJointVel(g - 1);
    if (link.m_jointType == btMultibodyLink::ePrismatic) {
      velocity += X_WG.linear() * from_bullet(link.m_axes[0].m_bottomVec) * rate;
      continue;
    }
    const Eigen::Vector3d pivot = X_WG * Eigen::Vector3d(-from_bullet(link.m_dVector));
    velocity += (X_WG.linear() * from_bullet(link.m_axes[0].m_topVec) * rate).cross(p_WP - pivot);
  }
  return velocity;
}

void Multibody::push_at(int group, const Eigen::Vector3d& force_W, const Eigen::Vector3d& p_WP) {
  const Eigen::Vector3d moment = (p_WP - X_WM(group).translation()).cross(force_W);
  if (group == 0) {
    body_->addBaseForce(to_bullet(force_W));
    body_->addBaseTorque(to_bullet(moment));
    return;
  }
  body_->addLinkForce(group - 1, to_bullet(force_W));
  body_->addLinkTorque(group - 1, to_bullet(moment));
}

}  // namespace walkman::plant
