#include "emulator/plant/dynamics/world_objects.h"

#include <algorithm>

#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>

#include "emulator/plant/contact/bullet_types.h"

namespace walkman::plant {

RobotModel with_weights(const SceneObject& object) {
  RobotModel model = object.model;
  for (const AttachedWeight& weight : object.weights) {
    const int first_link = static_cast<int>(model.links.size());
    const int first_joint = static_cast<int>(model.joints.size());
    Joint clamp;
    clamp.name = weight.name + "_clamp";
    clamp.parent_link = weight.link;
    clamp.child_link = first_link;
    clamp.X_PJ = weight.X_LA;
    for (Link link : weight.model.links) {
      link.name = weight.name + "/" + link.name;
      link.parent_joint = link.parent_joint < 0 ? first_joint : link.parent_joint + first_joint + 1;
      model.links.push_back(std::move(link));
    }
    model.joints.push_back(clamp);
    for (Joint joint : weight.model.joints) {
      joint.parent_link += first_link;
      joint.child_link += first_link;
      model.joints.push_back(std::move(joint));
    }
  }
  return model;
}

std::unique_ptr<Multibody> make_object(btMultiBodyDynamicsWorld& world, const SceneObject& object) {
  const RobotModel model = with_weights(object);
  return std::make_unique<Multibody>(world, model, RigidTree(model, {}, {}), false, object.X_WO, kObjectGroup,
                                     kObjectGroup | kFixedGroup | kRobotGroup);
}

void rebuild_object(btMultiBodyDynamicsWorld& world, const SceneObject& object,
                    std::unique_ptr<Multibody>& body) {
  SceneObject moved = object;
  moved.X_WO = body->X_WL(0);
  const btVector3 com = body->bullet().getBasePos();
  const btVector3 velocity = body->bullet().getBaseVel();
  const btVector3 spin = body->bullet().getBaseOmega();
  body.reset();
  body = make_object(world, moved);
  body->bullet().setBaseOmega(spin);
  body->bullet().setBaseVel(velocity + spin.cross(body->bullet().getBasePos() - com));
}

StaticBody::StaticBody(btMultiBodyDynamicsWorld& world, const FixedBody& fixed)
    : world_(world), name_(fixed.name) {
  const RigidTree tree(fixed.model, {}, {});
  // A static body is wholly fixed, so every link belongs to the root group and X_RM X_ML is its pose in the
  // root.
  const Eigen::Isometry3d X_RM = tree.groups().front().X_RM;
  for (std::size_t i = 0; i < fixed.model.links.size(); ++i) {
    for (const Solid& solid : solids_of(fixed.model.links[i].collisions)) {
      shapes_.push_back(make_shape(solid));
      const Eigen::Isometry3d X_WC = fixed.X_WF * X_RM * tree.X_ML(static_cast<int>(i)) * solid.X_LC;
      btRigidBody::btRigidBodyConstructionInfo info(0, nullptr, shapes_.back().get());
      info.m_startWorldTransform = to_bullet(X_WC);
      auto body = std::make_unique<btRigidBody>(info);
      auto parts = std::make_unique<ColliderParts>();
      parts->add(
          {solid.primitive, shapes_.back().get(), btTransform::getIdentity(), fixed.model.links[i].surface});
      parts->hang_on(*body);
      parts_.push_back(std::move(parts));
      world_.addRigidBody(body.get(), kFixedGroup, kObjectGroup | kRobotGroup);
      bodies_.push_back(std::move(body));
    }
  }
}

StaticBody::~StaticBody() {
  for (const auto& body : bodies_) world_.removeRigidBody(body.get());
}

bool StaticBody::owns(const btCollisionObject* object) const {
  return std::any_of(bodies_.begin(), bodies_.end(), [&](const auto& body) { return body.get() == object; });
}

}  // namespace walkman::plant
