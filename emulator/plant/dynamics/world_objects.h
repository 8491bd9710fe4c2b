#pragma once

#include <memory>
#include <string>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "emulator/plant/dynamics/multibody.h"
#include "emulator/scene/scene.h"

namespace walkman::plant {

/// The object's model with its weights attached by fixed joints, as one rigid tree.
[[nodiscard]] RobotModel with_weights(const SceneObject& object);

/// A movable object as a multibody without joints, at `object.X_WO` and at rest.
[[nodiscard]] std::unique_ptr<Multibody> make_object(btMultiBodyDynamicsWorld& world,
                                                     const SceneObject& object);

/// Rebuilds `body` after `object`'s weights have changed, keeping its pose and motion. Its contacts are found
/// again in the next step.
void rebuild_object(btMultiBodyDynamicsWorld& world, const SceneObject& object,
                    std::unique_ptr<Multibody>& body);

/// A body of the scene that never moves: one static rigid body for each collision solid of its URDF links.
class StaticBody {
 public:
  StaticBody(btMultiBodyDynamicsWorld& world, const FixedBody& fixed);
  ~StaticBody();
  StaticBody(const StaticBody&) = delete;
  StaticBody& operator=(const StaticBody&) = delete;

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] bool owns(const btCollisionObject* object) const;

 private:
  btMultiBodyDynamicsWorld& world_;
  std::string name_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<ColliderParts>> parts_;  // one per entry of `bodies_`
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
};

}  // namespace walkman::plant
