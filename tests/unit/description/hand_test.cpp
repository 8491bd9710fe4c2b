#include <cmath>

#include <gtest/gtest.h>

#include "robots.h"

namespace walkman::testing {
namespace {

constexpr double kPhalanx1 = 0.055;
constexpr double kPhalanx2 = 0.045;
constexpr double kClosed = 5.0;

struct Hand {
  std::string side;  // "R" or "L"
  double y;          // sign of the palm normal along the hand link's y axis
  friend void PrintTo(const Hand& hand, std::ostream* out) { *out << hand.side; }

  std::string motor() const { return side == "R" ? "r_handj_synergy" : "l_handj_synergy"; }
};

class SoftHand : public ::testing::TestWithParam<Hand> {
 protected:
  // Returns the tip of a finger in the hand link's frame at a motor angle.
  Eigen::Vector3d tip(const std::string& finger, double motor) const {
    const Posed pose(walkman_model(), {{GetParam().motor(), motor}});
    return pose(GetParam().side + "SoftHandLink").inverse() * pose(GetParam().side + finger + "Distal") *
           Eigen::Vector3d(0, 0, -kPhalanx2);
  }
  // Planar two-link arm, worked out by hand: flexion q1, q2 in the plane of the palm normal (y) and the
  // finger's closing direction (+z for fingers, -z for the thumb).
  Eigen::Vector3d planar_tip(double x, double root_z, double closing_z, double motor) const {
    const double q1 = -0.9 + 1.65 * motor / kClosed;
    const double q2 = 1.2 * motor / kClosed;
    const double along_normal = kPhalanx1 * std::cos(q1) + kPhalanx2 * std::cos(q1 + q2);
    const double closing = kPhalanx1 * std::sin(q1) + kPhalanx2 * std::sin(q1 + q2);
    return {x, GetParam().y * (0.0305 - 0.004 + along_normal), root_z + closing_z * closing};
  }
};

TEST_P(SoftHand, FingertipsFollowThePlanarChain) {
  for (const double motor : {0.0, 1.3, 2.5, kClosed}) {
    EXPECT_LT((tip("Finger1", motor) - planar_tip(-0.039, -0.252, 1, motor)).norm(), 1e-9);
    EXPECT_LT((tip("Finger4", motor) - planar_tip(0.039, -0.252, 1, motor)).norm(), 1e-9);
    EXPECT_LT((tip("Thumb", motor) - planar_tip(0, -0.168, -1, motor)).norm(), 1e-9);
  }
}

TEST_P(SoftHand, ClosesRoundABar) {
  // With the hand open, a 70 mm bar passes between fingertips and thumb; with it closed, they have crossed.
  EXPECT_GT(tip("Thumb", 0).z() - tip("Finger2", 0).z(), 0.070 + 0.018);
  EXPECT_LT(tip("Thumb", kClosed).z() - tip("Finger2", kClosed).z(), 0);
}

TEST_P(SoftHand, GraspFrameIsInThePalmsFace) {
  const Posed zero(walkman_model(), {});
  const std::string grasp = GetParam().side == "R" ? "r_hand_grasp" : "l_hand_grasp";
  const Eigen::Isometry3d X_HF = zero(GetParam().side + "SoftHandLink").inverse() * zero(grasp);
  EXPECT_LT((X_HF.translation() - Eigen::Vector3d(0, GetParam().y * 0.0305, -0.2170)).norm(), 1e-9);
  EXPECT_NEAR(X_HF.linear().col(1).y(), -GetParam().y, 1e-9);  // y opposite to the palm normal
  EXPECT_NEAR(X_HF.linear().col(2).z(), 1, 1e-9);
  EXPECT_NEAR(X_HF.linear().determinant(), 1, 1e-9);
}

TEST_P(SoftHand, HangsOnTheForceTorqueSensor) {
  const RobotModel& model = walkman_model();
  const std::string side = GetParam().side;
  const Link& hand = model.links[static_cast<std::size_t>(model.link_index(side + "SoftHandLink"))];
  const Joint& mount = model.joints[static_cast<std::size_t>(hand.parent_joint)];
  EXPECT_EQ(model.links[static_cast<std::size_t>(mount.parent_link)].name,
            side == "R" ? "r_arm_ft" : "l_arm_ft");
  const Posed zero(model, {});
  EXPECT_TRUE(zero(side + "SoftHandLink").isApprox(zero(side + "WrMot3"), 1e-12));
}

TEST_P(SoftHand, Weighs1200Grams) {
  const RobotModel& model = walkman_model();
  double mass = 0;
  for (const Link& link : model.links)
    if (link.name.front() == GetParam().side.front() &&
        (link.name.find("Hand") != std::string::npos || link.name.find("Finger") != std::string::npos ||
         link.name.find("Thumb") != std::string::npos))
      mass += link.mass;
  EXPECT_NEAR(mass, 1.2, 1e-9);
}

TEST_P(SoftHand, PalmFaceIsAtTheTcpAndNothingButFingersPassesIt) {
  const RobotModel& model = walkman_model();
  const Link& hand =
      model.links[static_cast<std::size_t>(model.link_index(GetParam().side + "SoftHandLink"))];
  ASSERT_EQ(hand.collisions.size(), 2U);
  double furthest = 0;
  for (const LinkGeometry& geometry : hand.collisions) {
    const auto& box = std::get<BoxShape>(geometry.shape);
    furthest = std::max(furthest, GetParam().y * geometry.X_LG.translation().y() + box.size.y() / 2);
  }
  EXPECT_NEAR(furthest, 0.0305, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Sides, SoftHand, ::testing::Values(Hand{"R", 1}, Hand{"L", -1}),
                         [](const auto& tested) { return tested.param.side == "R" ? "Right" : "Left"; });

}  // namespace
}  // namespace walkman::testing
