#include "urdf/reader/robot_description.h"

#include <gmock/gmock.h>

#include "robots.h"

namespace walkman::testing {
namespace {

TEST(RobotDescription, WalkmanIsKnownWithoutAScene) {
  const KnownRobot known(load_robot_description(kUrdf / "walkman.robot.yaml"));
  EXPECT_EQ(known.model.name, walkman_model().name);
  EXPECT_EQ(known.devices.buses.size(), 5U);
  EXPECT_EQ(known.description.working_hand().frame, "r_hand_grasp");
  ASSERT_TRUE(known.description.stance);
  EXPECT_THAT(known.description.stance->feet, ::testing::ElementsAre("l_leg_ft", "r_leg_ft"));
  EXPECT_EQ(known.description.pdo_layouts.size(), 4U);
}

TEST(RobotDescription, FdIsASwitch) {
  RobotChoice choice;
  choice.fd = true;
  const KnownRobot known(load_robot_description(kUrdf / "walkman.robot.yaml"), choice);
  for (const Bus& bus : known.devices.buses) EXPECT_TRUE(bus.fd) << bus.name;
}

TEST(RobotDescription, MeshesAreLookedUpInThePackagesAndHandAndStanceMayBeMissing) {
  const std::filesystem::path folder = std::filesystem::path(WALKMAN_TEST_DATA) / "mesh_robot";
  RobotChoice choice;
  choice.packages = {folder / "packages"};
  const KnownRobot known(load_robot_description(folder / "small.robot.yaml"), choice);
  EXPECT_EQ(known.model.links.front().name, "base_link");
  EXPECT_FALSE(known.description.stance);
  EXPECT_THAT(message_of([&] { (void)known.description.working_hand(); }),
              ::testing::HasSubstr("small.robot.yaml: there is no hand"));
}

// Which sensor sits where is the table's word.
TEST(RobotDescription, EverySensorHasItsKind) {
  const KnownRobot known(load_robot_description(kUrdf / "walkman.robot.yaml"));
  EXPECT_EQ(known.devices.device("r_arm_ft").sensor, "force_torque_45mm");
  EXPECT_EQ(known.devices.device("l_leg_ft").sensor, "force_torque_ankle");
  EXPECT_EQ(known.devices.device("RShSag").sensor, "");
}

}  // namespace
}  // namespace walkman::testing
