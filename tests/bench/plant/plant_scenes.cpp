#include "tests/bench/plant/plant_scenes.h"

#include <string>

namespace walkman::bench {

PlantScenes::PlantScenes(const std::filesystem::path& urdf)
    : scene_(load_scene(urdf / "scenes/experiment_1.yaml")),
      robot_(load_robot_model(scene_.robot.urdf)),
      devices_(load_device_table(scene_.robot.device_table, robot_)),
      actuators_(plant::load_actuators(urdf / "../emulator/plant/actuators")) {
  scene_.base = BaseKind::kFloating;
  scene_.X_WB.translation().z() = 1.0478;
  alone_ = scene_;
  alone_.objects.clear();
  std::erase_if(alone_.fixed, [](const FixedBody& body) { return body.name != "room"; });
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
  Scene scene = alone_;
  scene.X_WB.translation().z() = 1e4;
  return build(scene);
}

std::unique_ptr<plant::Plant> PlantScenes::standing() const {
  auto plant = build(alone_);
  for (int i = 0; i < 1000; ++i) step(*plant, 0);
  return plant;
}

std::unique_ptr<plant::Plant> PlantScenes::gripping() const {
  Scene scene = scene_;
  const auto open = build(scene);
  for (const char* hand : {"r_hand_grasp", "l_hand_grasp"}) {
    // A held bar's axis lies along the hand frame's x axis, its radius below the palm.
    constexpr double kRadius = 0.035;
    FixedBody bar{std::string(hand) + "_bar", "", scene.objects.front().model,
                  open->X_WL(robot_.link_index(hand))};
    bar.X_WF.translation() -= kRadius * bar.X_WF.linear().col(1);
    scene.fixed.push_back(bar);
  }
  auto plant = build(scene);
  for (int i = 0; i < 2500; ++i) step(*plant, kGrip);
  return plant;
}

}  // namespace walkman::bench
