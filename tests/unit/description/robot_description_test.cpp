#include "urdf/reader/robot_description.h"

#include <fstream>
#include <iterator>

#include <gmock/gmock.h>

#include "robots.h"

namespace walkman::testing {
namespace {

TEST(RobotDescription, WalkmanIsKnownWithoutAScene) {
  const KnownRobot known(load_robot_description(kUrdf / "walkman.robot.yaml"));
  EXPECT_EQ(known.model.name, walkman_model().name);
  EXPECT_EQ(known.devices.buses.size(), 5U);
  ASSERT_EQ(known.description.working_hands().size(), 2U);
  EXPECT_EQ(known.description.hands[0].frame, "r_hand_grasp");
  EXPECT_EQ(known.description.hands[1].frame, "l_hand_grasp");
  ASSERT_TRUE(known.description.stance);
  EXPECT_THAT(known.description.stance->feet, ::testing::ElementsAre("l_leg_ft", "r_leg_ft"));
  EXPECT_EQ(known.description.pdo_layouts.size(), 5U);
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
  EXPECT_THAT(message_of([&] { (void)known.description.working_hands(); }),
              ::testing::HasSubstr("small.robot.yaml: there is no hand"));
}

/// Reads and checks walkman.robot.yaml with `found` replaced by `by`; returns the message with which it is
/// refused.
std::string refusal(const std::string& found, const std::string& by) {
  const std::filesystem::path folder = std::filesystem::absolute(kUrdf);
  std::ifstream in(folder / "walkman.robot.yaml");
  std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const std::size_t at = text.find(found);
  EXPECT_NE(at, std::string::npos) << found;
  text.replace(at, found.size(), by);
  for (const char* file : {"walkman.urdf", "walkman.srdf", "walkman.devices.yaml", "walkman.identities.yaml"})
    text.replace(text.find(std::string(": ") + file) + 2, std::string(file).size(), (folder / file).string());
  const std::string layouts = folder.string() + "/pdo_layouts/";
  for (std::size_t i = text.find("pdo_layouts/"); i != std::string::npos;
       i = text.find("pdo_layouts/", i + layouts.size()))
    text.replace(i, std::string("pdo_layouts/").size(), layouts);
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / "bad.robot.yaml";
  std::ofstream(file) << text;
  return message_of([&] { KnownRobot known(load_robot_description(file)); });
}

TEST(RobotDescription, HandsThatDoNotFitTheRobotAreRefused) {
  using ::testing::HasSubstr;
  EXPECT_EQ(refusal("name: left", "name: links"), "");
  EXPECT_THAT(refusal("name: left", "name: right"), HasSubstr("\"right\" is already used"));
  EXPECT_THAT(refusal("joints: [RShSag, RShLat", "joints: [RShSag, RShSag"),
              HasSubstr("\"RShSag\" is listed twice"));
  EXPECT_THAT(refusal("joints: [RShSag,", "joints: [RShSagg,"),
              HasSubstr("continuous_torque_nm.RShSag: unknown key"));
  EXPECT_THAT(refusal("motor: l_handj_synergy", "motor: l_handj"),
              HasSubstr("has no such device \"l_handj\""));
  EXPECT_THAT(refusal("posture: left_arm_at_work", "posture: left_arm"),
              HasSubstr("no group_state \"left_arm\""));
  EXPECT_THAT(refusal("posture: left_arm_at_work", "posture: right_arm_at_work"),
              HasSubstr("which is not among"));
  EXPECT_THAT(refusal("lower_rad: -2.9,", "lower_rad: -3.9,"), HasSubstr("ranges from -3.9 to -0.25 rad"));
  EXPECT_THAT(refusal("lower_rad: -2.9,", "lower_rad: 2.9,"), HasSubstr("is not above lower_rad"));
  EXPECT_THAT(refusal("lower_rad: -2.9,", "lower_rad: .nan,"), HasSubstr("lower_rad"));
  EXPECT_THAT(refusal("{joint: RElbj,", "{joint: LElbj,"), HasSubstr("is not among the joints"));
  EXPECT_THAT(refusal("ForearmPlate: 20,", "ForearmPlat: 20,"), HasSubstr("did you mean \"RForearmPlate\""));
  EXPECT_THAT(refusal("ForearmPlate: 20,", "ForearmPlate: -20,"), HasSubstr("RForearmPlate"));
  EXPECT_THAT(refusal("frame: l_hand_grasp", "frame: l_hand"), HasSubstr("has no link \"l_hand\""));
  EXPECT_THAT(refusal("tilt: NeckPitchj", "tilt: NeckPitch"), HasSubstr("has no such device"));
}

TEST(RobotDescription, DisabledCollisionsNameLinks) {
  const KnownRobot known(load_robot_description(kUrdf / "walkman.robot.yaml"));
  const auto pairs = load_disabled_collisions(known.description.srdf, known.model);
  EXPECT_THAT(pairs, ::testing::Contains(std::pair<std::string, std::string>("RForearm", "RWrMot3")));
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / "bad.srdf";
  std::ofstream(file)
      << "<robot name=\"r\"><disable_collisions link1=\"RForearm\" link2=\"RFoerarm\"/></robot>";
  EXPECT_THAT(message_of([&] { (void)load_disabled_collisions(file, known.model); }),
              ::testing::HasSubstr("has no link \"RFoerarm\""));
  std::ofstream(file) << "<robot name=\"r\"><disable_collisions link1=\"RForearm\"/></robot>";
  EXPECT_THAT(message_of([&] { (void)load_disabled_collisions(file, known.model); }),
              ::testing::HasSubstr("there is no link2"));
}

// The device table determines which sensor is mounted where.
TEST(RobotDescription, EverySensorHasItsKind) {
  const KnownRobot known(load_robot_description(kUrdf / "walkman.robot.yaml"));
  EXPECT_EQ(known.devices.device("r_arm_ft").sensor, "force_torque_45mm");
  EXPECT_EQ(known.devices.device("l_leg_ft").sensor, "force_torque_ankle");
  EXPECT_EQ(known.devices.device("RShSag").sensor, "");
}

/// The two sides read different files: the motor data assumed by the robot's computer, and the emulated data.
TEST(RobotDescription, TheMotorsAreTakenForWhatTheyAre) {
  const KnownRobot known(load_robot_description(kUrdf / "walkman.robot.yaml"));
  for (const HandParts& hand : known.description.hands) {
    EXPECT_EQ(hand.continuous_torque.size(), hand.arm.joints.size());
    for (const auto& [joint, torque] : hand.continuous_torque) {
      const auto file =
          kUrdf / "../emulator/plant/actuators" / (known.devices.device(joint).actuator + ".yaml");
      std::ifstream in(file);
      std::string key;
      double emulated = 0;
      while (in >> key)
        if (key == "continuous_torque:") in >> emulated;
      EXPECT_EQ(torque, emulated) << joint;
    }
  }
}

}  // namespace
}  // namespace walkman::testing
