#include <cmath>

#include <Eigen/Eigenvalues>
#include <gmock/gmock.h>

#include "robots.h"

namespace walkman::testing {
namespace {

double height_above_sole(const Posed& pose, const std::string& link) {
  return pose(link).translation().z() - pose("r_sole").translation().z();
}

TEST(Walkman, WeighsWhatThePaperSays) { EXPECT_NEAR(walkman_model().total_mass(), 118.000, 1e-3); }

TEST(Walkman, Has31BodyJointsAndTwoHandMotors) {
  int body = 0;
  int mimic = 0;
  int continuous = 0;
  for (const Joint& joint : walkman_model().joints) {
    mimic += joint.mimic ? 1 : 0;
    continuous += joint.type == JointType::kContinuous ? 1 : 0;
    body += joint.type == JointType::kRevolute && !joint.mimic ? 1 : 0;
  }
  EXPECT_EQ(body, 31 + 2);
  EXPECT_EQ(mimic, 2 * 10);
  EXPECT_EQ(continuous, 1);
}

// Heights from the collected facts, computed there from the original URDF with another program.
TEST(Walkman, HeightsAtZeroPosture) {
  const Posed zero(walkman_model(), {});
  EXPECT_NEAR(height_above_sole(zero, "base_link"), 1.1174, 1e-4);
  EXPECT_NEAR(height_above_sole(zero, "DWYTorso"), 1.536, 1e-3);
  EXPECT_NEAR(height_above_sole(zero, "RShr"), 1.571, 1e-3);
  EXPECT_NEAR(height_above_sole(zero, "multisense/head"), 1.718, 1e-3);
  EXPECT_NEAR(zero("LShr").translation().y() - zero("RShr").translation().y(), 0.657, 1e-3);
  EXPECT_NEAR(zero("LThighUpLeg").translation().y() - zero("RThighUpLeg").translation().y(), 0.362, 1e-3);
}

TEST(Walkman, HomePosture) {
  const RobotModel& model = walkman_model();
  const auto home_values = load_posture(kUrdf / "walkman.srdf", "home", model);
  EXPECT_EQ(home_values.size(), 33U);
  const Posed home(model, home_values);
  EXPECT_NEAR(height_above_sole(home, "base_link"), 1.0478, 1e-4);
  EXPECT_NEAR(height_above_sole(home, "multisense/head"), 1.587, 1e-3);
  EXPECT_NEAR(home("l_sole").translation().z(), home("r_sole").translation().z(), 1e-9);

  // Centre of mass of variant B118 in the collected facts: x relative to the midpoint of the soles, z above
  // them.
  const Eigen::Vector3d com = centre_of_mass(model, home.all());
  const Eigen::Vector3d soles = 0.5 * (home("l_sole").translation() + home("r_sole").translation());
  EXPECT_NEAR(com.x() - soles.x(), 0.0485, 1e-3);
  EXPECT_NEAR(com.z() - soles.z(), 0.9799, 1e-3);
}

TEST(Walkman, EveryBodyIsPhysical) {
  for (const Link& link : walkman_model().links) {
    if (link.mass == 0) continue;
    const Eigen::Vector3d moments =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(link.I_LLcm_L).eigenvalues();
    EXPECT_GT(moments[0], 0) << link.name;
    EXPECT_LE(moments[2], (moments[0] + moments[1]) * (1 + 1e-6)) << link.name;
  }
}

TEST(Walkman, LeftSideMirrorsTheRight) {
  const RobotModel& model = walkman_model();
  const Eigen::Vector3d mirror(1, -1, 1);
  const Posed zero(model, {});
  int compared = 0;
  for (const Link& right : model.links) {
    std::string name = right.name;
    if (name.front() != 'R' && name.substr(0, 2) != "r_") continue;
    if (name == "r_hand_grasp")
      continue;  // its y is opposite to the palm normal on both sides: not a mirror image
    name.front() = name.front() == 'R' ? 'L' : 'l';
    const Link& left = model.links[static_cast<std::size_t>(model.link_index(name))];
    EXPECT_DOUBLE_EQ(left.mass, right.mass) << name;
    EXPECT_LT((left.p_LLcm - mirror.cwiseProduct(right.p_LLcm)).norm(), 1e-9) << name;
    const Eigen::Matrix3d mirrored = mirror.asDiagonal() * right.I_LLcm_L * mirror.asDiagonal();
    EXPECT_LT((left.I_LLcm_L - mirrored).norm(), 1e-9) << name;
    EXPECT_LT((zero(name).translation() - mirror.cwiseProduct(zero(right.name).translation())).norm(), 1e-9)
        << name;
    ASSERT_EQ(left.collisions.size(), right.collisions.size()) << name;
    for (std::size_t i = 0; i < left.collisions.size(); ++i) {
      const Eigen::Vector3d expected = mirror.cwiseProduct(right.collisions[i].X_LG.translation());
      EXPECT_LT((left.collisions[i].X_LG.translation() - expected).norm(), 1e-9) << name;
    }
    ++compared;
  }
  EXPECT_EQ(compared, 13 + 3 + 10 + 3);  // limbs, hand bodies, phalanges, sensor and sole frames
}

TEST(Walkman, CamerasAre7CentimetresApartAndLookForward) {
  const Posed zero(walkman_model(), {});
  const auto& left = zero("multisense/left_camera_optical_frame");
  const auto& right = zero("multisense/right_camera_optical_frame");
  EXPECT_NEAR((left.translation() - right.translation()).norm(), 0.070, 1e-9);
  EXPECT_LT((left.linear().col(2) - Eigen::Vector3d::UnitX()).norm(), 1e-8);
  EXPECT_LT((left.linear().col(1) + Eigen::Vector3d::UnitZ()).norm(), 1e-8);
}

TEST(Walkman, ParentsComeBeforeChildren) {
  const RobotModel& model = walkman_model();
  ASSERT_EQ(model.links.size(), model.joints.size() + 1);
  EXPECT_EQ(model.links.front().name, "base_link");
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const Joint& joint = model.joints[i];
    EXPECT_EQ(joint.child_link, static_cast<int>(i) + 1);
    EXPECT_LT(joint.parent_link, joint.child_link);
    EXPECT_EQ(model.links[static_cast<std::size_t>(joint.child_link)].parent_joint, static_cast<int>(i));
    EXPECT_EQ(model.joint_index(joint.name), static_cast<int>(i));
    EXPECT_NEAR(joint.axis.norm(), 1, 1e-12);
  }
  // Siblings keep the order of the file: the waist comes before the arms.
  EXPECT_LT(model.joint_index("backpack_joint"), model.joint_index("NeckYawj"));
  EXPECT_LT(model.joint_index("RShSag"), model.joint_index("LShSag"));
}

TEST(Walkman, VisualsDefaultToCollisions) {
  for (const Link& link : walkman_model().links) {
    if (link.collisions.empty()) continue;
    EXPECT_EQ(link.visuals.size(), link.collisions.size()) << link.name;
  }
}

TEST(Walkman, UnknownNamesAreAnswered) {
  EXPECT_THAT(message_of([] { (void)walkman_model().joint_index("RElbow"); }),
              ::testing::AllOf(::testing::HasSubstr("\"walkman\""), ::testing::HasSubstr("\"RElbow\"")));
  EXPECT_THROW((void)walkman_model().link_index("RElbow"), std::out_of_range);
  EXPECT_FALSE(walkman_model().find_link("RElbow").has_value());
}

}  // namespace
}  // namespace walkman::testing
