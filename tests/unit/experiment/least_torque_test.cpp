#include "apps/experiment/least_torque.h"

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "apps/shared/emulated_world.h"
#include "drivers/robot/robot.h"
#include "emulator/bus/can_bus.h"
#include "emulator/emulator.h"

namespace walkman::apps {
namespace {

/// Returns the least torque for the first object of a shipped scene, with everything in the scene rotated by
/// `angle` (rad) about `axis` through that object.
double least_of(const std::string& scene, double angle = 0,
                const Eigen::Vector3d& axis = Eigen::Vector3d::UnitX()) {
  const std::string tree = WALKMAN_SOURCE_TREE;
  WorldOptions options;
  options.scene = tree + "/urdf/scenes/" + scene + ".yaml";
  options.actuators = tree + "/emulator/plant/actuators";
  options.model_error = "none";
  EmulatedWorld world(options);
  SceneObject& object = world.scene.objects.front();
  const Eigen::Vector3d middle = object.X_WO.translation();
  const Eigen::Isometry3d turned =
      Eigen::Translation3d(middle) * Eigen::AngleAxisd(angle, axis) * Eigen::Translation3d(-middle);
  object.X_WO = turned * object.X_WO;
  for (FixedBody& body : world.scene.fixed) body.X_WF = turned * body.X_WF;
  const robot::Robot robot(world.robot.model, world.robot.devices, world.emulator.interfaces());
  const MethodParameters parameters = load_method_parameters(tree + "/adaptation/parameters.yaml");
  const auto least = least_torque(world.scene, object, world.robot, robot.joint_names(), parameters);
  return least.value_or(std::nan(""));
}

TEST(LeastTorque, IsNothingWhereAHandCanBeAroundTheCentreOfMass) {
  EXPECT_LT(least_of("experiment_1"), 0.02);
}

TEST(LeastTorque, OnATableThatIsNotLevelToo) {
  for (const double slope : {-0.06, 0.06}) {
    EXPECT_LT(least_of("experiment_1", slope, Eigen::Vector3d::UnitX()), 0.02) << slope;
    EXPECT_LT(least_of("experiment_1", slope, Eigen::Vector3d::UnitY()), 0.02) << slope;
  }
}

/// The centre of mass is 14.9 mm inside the head; a palm of 11 cm cannot come closer to the head than half
/// its width, and need not stay more than 2 cm farther away.
TEST(LeastTorque, OfAHammerIsThatOfAPalmBesideItsHead) {
  const double weight = 0.55 * 9.81, inside = 0.0149, half_palm = 0.055;
  EXPECT_GT(least_of("experiment_10"), weight * (inside + half_palm));
  EXPECT_LT(least_of("experiment_10"), weight * (inside + half_palm + 0.02));
}

/// 0.6 kg with its centre of mass 26 mm beside the only handle that fits a hand.
TEST(LeastTorque, BesideAHandleIsItsLeverAtLeast) {
  const double weight = 0.6 * 9.81;
  EXPECT_GT(least_of("experiment_6"), 0.99 * weight * 0.026);
  EXPECT_LT(least_of("experiment_6"), 1.1 * weight * 0.026);
}

}  // namespace
}  // namespace walkman::apps
