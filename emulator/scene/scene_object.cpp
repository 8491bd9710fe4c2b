#include <cstddef>

#include "emulator/scene/draws.h"
#include "emulator/scene/scene.h"
#include "urdf/reader/kinematics.h"

namespace walkman {
Eigen::Isometry3d SceneObject::X_OA(const AttachedWeight& weight) const {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation().x() = weight.position - length / 2;
  return X;
}

double SceneObject::mass() const {
  double mass = model.total_mass();
  for (const AttachedWeight& weight : weights) mass += weight.model.total_mass();
  return mass;
}

Eigen::Vector3d SceneObject::p_OOcm() const {
  Eigen::Vector3d moment = model.total_mass() * centre_of_mass(model, link_poses(model, {}));
  for (const AttachedWeight& weight : weights) {
    const Eigen::Vector3d p_AAcm = centre_of_mass(weight.model, link_poses(weight.model, {}));
    moment += weight.model.total_mass() * (X_OA(weight) * p_AAcm);
  }
  return moment / mass();
}

void apply_jitter(Scene& scene, std::uint64_t seed) {
  Draws draws(seed);
  for (SceneObject& object : scene.objects) {
    object.X_WO.translation().x() += scene.jitter.x * draws.symmetric();
    object.X_WO.translation().y() += scene.jitter.y * draws.symmetric();
    const Eigen::AngleAxisd yaw(scene.jitter.yaw * draws.symmetric(), Eigen::Vector3d::UnitZ());
    object.X_WO.linear() = yaw.toRotationMatrix() * object.X_WO.linear();
  }
}

}  // namespace walkman
