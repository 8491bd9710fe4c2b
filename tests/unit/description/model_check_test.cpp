#include "urdf/reader/model_check.h"

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "robots.h"

namespace walkman::testing {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::string> frames(const ModelReport& report, SensorKind kind) {
  std::vector<std::string> names;
  for (const CheckedSensor& sensor : report.sensors)
    if (sensor.kind == kind) names.push_back(sensor.frame);
  return names;
}

TEST(ModelCheck, Walkman) {
  const ModelReport report = check_model(kUrdf / "walkman.urdf");
  EXPECT_EQ(report.name, "walkman");
  EXPECT_NEAR(report.total_mass, 118, 1e-3);
  EXPECT_EQ(report.count(JointRole::kBody), 31);
  EXPECT_EQ(report.count(JointRole::kHandMotor), 2);
  EXPECT_EQ(report.count(JointRole::kPassive), 20);
  EXPECT_EQ(report.count(JointRole::kContinuous), 1);
  EXPECT_THAT(frames(report, SensorKind::kForceTorque),
              ElementsAre("r_arm_ft", "l_arm_ft", "r_leg_ft", "l_leg_ft"));
  EXPECT_THAT(frames(report, SensorKind::kCamera),
              ElementsAre("multisense/left_camera_optical_frame", "multisense/right_camera_optical_frame"));
  EXPECT_THAT(frames(report, SensorKind::kImu),
              ElementsAre("imu_link", "imu_link2", "multisense/head_imu_link"));
  EXPECT_THAT(frames(report, SensorKind::kLaser), ElementsAre("multisense/head_hokuyo_frame"));
  EXPECT_TRUE(report.unusable.empty());
}

TEST(ModelCheck, ListsAllThatCannotBeUsedAndGoesOn) {
  const ModelReport report = check_model(kData / "partly_usable.urdf");
  std::vector<std::string> elements;
  for (const UrdfFinding& finding : report.unusable) elements.push_back(finding.element);
  EXPECT_THAT(elements, ElementsAre("link \"base\", collision 2", "link \"arm\", inertial",
                                    "link \"tool\", visual 1", "joint \"floater\"", "joint \"slider\"",
                                    "joint \"no_limits\"", "joint \"follower\""));
  for (const UrdfFinding& finding : report.unusable) EXPECT_GT(finding.line, 1);
  EXPECT_THAT(report.unusable[0].reason, HasSubstr("capsule"));
  EXPECT_THAT(report.unusable[3].reason, HasSubstr("floating"));
  EXPECT_DOUBLE_EQ(report.total_mass, 3);
  EXPECT_EQ(report.count(JointRole::kBody), 2);  // hinge and, without the joint it followed, follower
  EXPECT_EQ(report.fixed_joints, 3);
  EXPECT_THAT(frames(report, SensorKind::kLaser), ElementsAre("tool"));  // from its <gazebo> element
}

TEST(ModelCheck, TextAndJsonSayTheSame) {
  const ModelReport report = check_model(kData / "partly_usable.urdf");
  const std::string text = to_text(report);
  EXPECT_THAT(text, AllOf(HasSubstr("3.000 kg"),
                          HasSubstr("partly_usable.urdf:9: link \"base\", collision 2"), HasSubstr("hinge")));
  const auto json = nlohmann::json::parse(to_json(report));
  EXPECT_EQ(json["name"], "partly_usable");
  EXPECT_EQ(json["mass"], 3.0);
  EXPECT_EQ(json["dof"]["body"], 2);
  EXPECT_EQ(json["unusable"].size(), report.unusable.size());
  EXPECT_EQ(json["unusable"][0]["line"], 9);
  EXPECT_EQ(json["joints"][0]["name"], "hinge");
  EXPECT_EQ(json["joints"][0]["upper"], 1.5);
}

TEST(ModelCheck, NoTreeIsAnError) {
  EXPECT_THROW((void)check_model(kData / "bad_two_roots.urdf"), std::runtime_error);
}

}  // namespace
}  // namespace walkman::testing
