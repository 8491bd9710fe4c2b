// The hand's weight on the wrist compared with sums over the URDF's bodies at explicit poses.

#include "adaptation/wrench/hand_weight.h"

#include <gtest/gtest.h>

#include "urdf/reader/robot_model.h"

namespace walkman::wrench {
namespace {

class HandWeightTest : public ::testing::Test {
 protected:
  RobotModel model_ = load_robot_model(std::string(WALKMAN_URDF_DIR) + "/walkman.urdf");
  motion::KinematicTree kinematics_{model_, {"RElbj", "RWrj1", "RWrj2"}};
  HandWeight weight_{model_, "r_arm_ft"};

  Wrench at(double elbow, double pitch, double roll, double synergy) {
    kinematics_.set_passive("r_handj_synergy", synergy);
    kinematics_.update(Eigen::Vector3d(elbow, pitch, roll));
    return weight_.F_So_S(kinematics_);
  }
};

TEST_F(HandWeightTest, IsTheSoftHandsMass) { EXPECT_NEAR(weight_.mass(), 1.2, 1e-6); }

TEST_F(HandWeightTest, ForceIsTheWeightInSensorAxes) {
  const Wrench F = at(-1.2, 0.3, -0.4, 0);
  EXPECT_NEAR(F.force.norm(), 1.2 * 9.81, 1e-9);
  const Eigen::Matrix3d R_WS = kinematics_.X_WL(model_.link_index("r_arm_ft")).linear();
  EXPECT_NEAR((R_WS * F.force - Eigen::Vector3d(0, 0, -1.2 * 9.81)).norm(), 0, 1e-9);
}

TEST_F(HandWeightTest, LeverIsTheHandsCentreOfMassInEveryPosture) {
  // The centre of mass seen from the sensor does not depend on the posture of the arm: recover it from one
  // posture, predict another.
  const auto lever_square_to_force = [](const Wrench& F) {
    return Eigen::Vector3d(F.force.cross(F.torque) / F.force.squaredNorm());
  };
  const Wrench down = at(0, 0, 0, 0);
  const Wrench level = at(-M_PI / 2, 0, 0, 0);
  const Eigen::Vector3d a =
      lever_square_to_force(down);  // x and y of the centre of mass (force along −z of S)
  const Eigen::Vector3d b = lever_square_to_force(level);  // its y and z (force along x of S)
  const Eigen::Vector3d com(a.x(), a.y(), b.z());
  const Wrench other = at(-0.9, 0.5, 0.7, 0);
  EXPECT_NEAR((com.cross(other.force) - other.torque).norm(), 0, 1e-9);
  EXPECT_NEAR(a.y(), b.y(), 1e-9);
}

TEST_F(HandWeightTest, MovesWithTheFingers) {
  const Wrench open = at(-M_PI / 2, 0, 0, 0);
  const Wrench closed = at(-M_PI / 2, 0, 0, 5);
  const double moved = (open.torque - closed.torque).norm();
  EXPECT_GT(moved, 1e-4);  // ten phalanges of 12 g move by a few centimetres
  EXPECT_LT(moved, 0.12 * 9.81 * 0.08);
  EXPECT_NEAR((open.force - closed.force).norm(), 0, 1e-9);
}

// Around a handle of 7 cm the phalanges' moment is that of a planar model of rods, 12 g each.
TEST_F(HandWeightTest, HoldsTheFingersAroundAHandle) {
  const Wrench open = at(-M_PI / 2, 0, 0, 0);
  const auto fingers = motion::Grip(model_, "r_hand_grasp", "r_handj_synergy").around(0.035);
  const Eigen::Isometry3d X_WH = kinematics_.X_WL(model_.link_index("r_hand_grasp"));
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (const auto& [link, X_HL] : fingers) {
    const bool proximal =
        model_.links[static_cast<std::size_t>(link)].name.find("Proximal") != std::string::npos;
    const Eigen::Vector3d middle(0, 0, proximal ? -0.0275 : -0.0225);
    moment += 0.012 * (X_WH * (X_HL * middle) - kinematics_.X_WL(link) * middle);
  }
  weight_.hold("r_hand_grasp", fingers);
  const Wrench held = at(-M_PI / 2, 0, 0, 0);
  const Eigen::Matrix3d R_WS = kinematics_.X_WL(model_.link_index("r_arm_ft")).linear();
  EXPECT_LT((R_WS * (held.torque - open.torque) - moment.cross(Eigen::Vector3d(0, 0, -9.81))).norm(), 1e-9);
  EXPECT_GT((held.torque - open.torque).norm(), 0.01);
  weight_.hold("r_hand_grasp", {});
  EXPECT_EQ(at(-M_PI / 2, 0, 0, 0).torque, open.torque);
}

TEST_F(HandWeightTest, RefusesAFrameWithNothingBelow) {
  EXPECT_THROW(HandWeight(model_, "multisense/left_camera_optical_frame"), std::runtime_error);
}

}  // namespace
}  // namespace walkman::wrench
