#include "tests/bench/plant/plant_scenes.h"

#include <stdexcept>

namespace walkman::bench {

PlantScenes::PlantScenes(const std::filesystem::path& urdf)
    : scene_(load_scene(urdf / "scenes/experiment_1.yaml")),
      robot_(load_robot_model(scene_.robot_urdf)),
      devices_(load_device_table(scene_.device_table, robot_)),
      actuators_(plant::load_actuators(urdf / "../emulator/plant/actuators")) {
  scene_.base = BaseKind::kFloating;
  scene_.X_WB.translation().z() = 1.0478;
  std::erase_if(scene_.fixed, [](const FixedBody& body) { return body.name != "room"; });
  for (const Bus& bus : devices_.buses) {
    for (const Device& device : bus.devices) {
      if (!device.actuator.empty()) is_hand_.push_back(device.kind == DeviceKind::kHandDrive);
    }
  }
}

std::unique_ptr<plant::Plant> PlantScenes::build(const Scene& scene) const {
  return std::make_unique<plant::Plant>(robot_, scene, devices_, actuators_);
}

void PlantScenes::step(plant::Plant& plant, double grip) const {
  for (int s = 0; s < plant::Plant::kSubSteps; ++s) {
    for (int d = 0; d < plant.drive_count(); ++d) {
      const bool closes = grip != 0 && is_hand_[static_cast<std::size_t>(d)];
      plant.advance_drive(d, closes ? grip : 0, !closes);
    }
  }
  plant.step();
}

std::unique_ptr<plant::Plant> PlantScenes::contact_free() const {
  Scene scene = scene_;
  scene.objects.clear();
  scene.X_WB.translation().z() = 1e4;
  return build(scene);
}

std::unique_ptr<plant::Plant> PlantScenes::standing() const {
  Scene scene = scene_;
  scene.objects.clear();
  auto plant = build(scene);
  for (int i = 0; i < 1000; ++i) step(*plant, 0);
  return plant;
}

std::unique_ptr<plant::Plant> PlantScenes::holding() const {
  Scene scene = scene_;
  // The bar's axis lies its radius below either palm; home is symmetric, so one line serves both hands.
  const auto empty = build(scene);
  const Eigen::Isometry3d X_WR = empty->X_WL(robot_.link_index("r_hand_grasp"));
  const Eigen::Isometry3d X_WL = empty->X_WL(robot_.link_index("l_hand_grasp"));
  constexpr double kRadius = 0.035;
  const Eigen::Vector3d right = X_WR * Eigen::Vector3d(0, -kRadius, 0);
  const Eigen::Vector3d left = X_WL * Eigen::Vector3d(0, -kRadius, 0);
  const Eigen::Vector3d x = (right - left).normalized();  // the bar's left end is on the robot's left
  const Eigen::Vector3d y = (X_WR.linear().col(1) - X_WR.linear().col(1).dot(x) * x).normalized();
  SceneObject& bar = scene.objects.front();
  bar.X_WO.linear().col(0) = x;
  bar.X_WO.linear().col(1) = y;
  bar.X_WO.linear().col(2) = x.cross(y);
  bar.X_WO.translation() = (right + left) / 2;
  auto plant = build(scene);
  for (int i = 0; i < 3000; ++i) step(*plant, kGrip);
  if ((plant->X_WO(0).translation() - plant->X_WL(robot_.link_index("r_hand_grasp")).translation()).norm() >
      1)
    throw std::runtime_error("the bar was dropped, expected it held in both hands");
  return plant;
}

}  // namespace walkman::bench
