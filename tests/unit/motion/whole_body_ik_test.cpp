#include "adaptation/motion/whole_body_ik.h"

#include <numeric>

#include <gtest/gtest.h>

#include "tests/unit/motion/reference_robot.h"

namespace walkman::motion {
namespace {

constexpr double kDt = 0.005;

class WholeBodyIkTest : public testing::Test {
 protected:
  WholeBodyIkTest() : robot(reference_robot()), kinematics(robot.model, robot.joint_names), q(robot.q_home) {
    kinematics.set_base(robot.X_WB);
    kinematics.update(q);
    all.resize(static_cast<std::size_t>(kinematics.dof()));
    std::iota(all.begin(), all.end(), 0);
  }

  [[nodiscard]] Eigen::Isometry3d pose(const char* link) const {
    return kinematics.X_WL(robot.model.link_index(link));
  }

  /// Moves joints and root by the solution.
  void integrate(const WholeBodyIk& ik) {
    q += kDt * ik.joint_velocity();
    Eigen::Isometry3d X_WB = kinematics.X_WB();
    const Eigen::Vector3d turn = kDt * ik.base_velocity().head<3>();
    if (turn.norm() > 0)
      X_WB.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix() * X_WB.linear();
    X_WB.translation() += kDt * ik.base_velocity().tail<3>();
    kinematics.set_base(X_WB);
    kinematics.update(q);
  }

  void expect_within_limits() const {
    for (int i = 0; i < kinematics.dof(); ++i) {
      EXPECT_GE(q[i], kinematics.limits(i).lower - 1e-9) << robot.joint_names[static_cast<std::size_t>(i)];
      EXPECT_LE(q[i], kinematics.limits(i).upper + 1e-9) << robot.joint_names[static_cast<std::size_t>(i)];
    }
  }

  static constexpr auto kStill = [] { return Eigen::Matrix<double, 6, 1>::Zero().eval(); };

  const ReferenceRobot& robot;
  KinematicTree kinematics;
  Eigen::VectorXd q;
  std::vector<int> all;
};

TEST_F(WholeBodyIkTest, FloatingBaseReachesWithFeetInPlaceAndBalance) {
  WholeBodyIk ik(kinematics, BaseMotion::kFloating, all, {});
  EXPECT_EQ(ik.variables(), 37);
  const int hand = robot.model.link_index("r_hand_grasp");
  const std::array<int, 2> feet = {robot.model.link_index("LFoot"), robot.model.link_index("RFoot")};
  const std::array<Eigen::Isometry3d, 2> X_WF = {pose("LFoot"), pose("RFoot")};
  Eigen::Isometry3d X_WH = pose("r_hand_grasp");
  X_WH.translation() += Eigen::Vector3d(0.25, 0.05, 0.15);
  const Eigen::Vector2d p_balance = 0.5 * (X_WF[0].translation() + X_WF[1].translation()).head<2>();
  for (int step = 0; step < 1200; ++step) {
    ik.start(q, kDt);
    ik.next_level();
    for (std::size_t i = 0; i < 2; ++i)
      ik.track_pose(feet[i], Eigen::Vector3d::Zero(), X_WF[i], kStill(), 20);
    ik.next_level();
    ik.track_pose(hand, Eigen::Vector3d::Zero(), X_WH, kStill(), 4);
    ik.next_level();
    ik.track_com(p_balance, Eigen::Vector2d::Zero(), 4);
    ik.next_level(0.1);
    ik.track_orientation(robot.model.link_index("DWYTorso"), Eigen::Matrix3d::Identity(),
                         Eigen::Vector3d::Zero(), 2);
    ik.next_level(0.1);
    for (const int dof : all) ik.track_joint(dof, robot.q_home[dof], 1);
    ASSERT_EQ(ik.solve(), QpStatus::kSolved) << step;
    EXPECT_LE(ik.joint_velocity().cwiseAbs().maxCoeff(), 1.0 + 1e-8);
    integrate(ik);
    expect_within_limits();
    for (std::size_t i = 0; i < 2; ++i) {
      // The error left by a step is of second order, at most (1 rad/s · 5 ms)² / 2 per step, and decays with
      // gain 20.
      EXPECT_LT((kinematics.X_WL(feet[i]).translation() - X_WF[i].translation()).norm(), 1.25e-4);
      EXPECT_LT(rotation_error(kinematics.X_WL(feet[i]).linear(), X_WF[i].linear()).norm(), 1.25e-4);
    }
  }
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_LT((kinematics.X_WL(feet[i]).translation() - X_WF[i].translation()).norm(), 1e-7);
  EXPECT_LT((pose("r_hand_grasp").translation() - X_WH.translation()).norm(), 1e-6);
  EXPECT_LT(rotation_error(pose("r_hand_grasp").linear(), X_WH.linear()).norm(), 1e-6);
  EXPECT_LT((kinematics.com().head<2>() - p_balance).norm(), 1e-6);
}

TEST_F(WholeBodyIkTest, HandTaskIsBlindToThePosture) {
  const int hand = robot.model.link_index("r_hand_grasp");
  Eigen::Isometry3d X_WH = pose("r_hand_grasp");
  X_WH.translation() += Eigen::Vector3d(0.01, 0.005, 0.02);
  Eigen::MatrixXd J(6, kinematics.dof());
  kinematics.jacobian(hand, Eigen::Vector3d::Zero(), J);
  const auto hand_velocity = [&](double posture_gain) -> Eigen::VectorXd {
    WholeBodyIk ik(kinematics, BaseMotion::kFixed, all, {.velocity = 2, .acceleration = 1e4});
    ik.start(q, kDt);
    ik.next_level();
    ik.track_pose(hand, Eigen::Vector3d::Zero(), X_WH, kStill(), 5);
    ik.next_level();
    for (const int dof : all) ik.track_joint(dof, 0, posture_gain);
    EXPECT_EQ(ik.solve(), QpStatus::kSolved);
    return J * ik.joint_velocity();
  };
  EXPECT_LT((hand_velocity(3) - hand_velocity(0)).norm(), 1e-6);
  EXPECT_NEAR(hand_velocity(3)[5], 0.1, 1e-4);
}

TEST_F(WholeBodyIkTest, LimitsHoldAgainstAnUnreachableTarget) {
  WholeBodyIk ik(kinematics, BaseMotion::kFixed, all, {.velocity = 3, .acceleration = 30});
  const int hand = robot.model.link_index("r_hand_grasp");
  Eigen::Isometry3d beyond = pose("r_hand_grasp");
  beyond.translation() = Eigen::Vector3d(-3, 2, 4);
  double acceleration = 0;
  Eigen::VectorXd last = Eigen::VectorXd::Zero(q.size());
  for (int step = 0; step < 600; ++step) {
    ik.start(q, kDt);
    ik.next_level();
    ik.track_pose(hand, Eigen::Vector3d::Zero(), beyond, kStill(), 5);
    ik.next_level();
    for (const int dof : all) ik.track_joint(dof, robot.q_home[dof], 1);
    ASSERT_EQ(ik.solve(), QpStatus::kSolved);
    EXPECT_LE(ik.joint_velocity().cwiseAbs().maxCoeff(), 3 + 1e-8);
    acceleration = std::max(acceleration, (ik.joint_velocity() - last).cwiseAbs().maxCoeff() / kDt);
    last = ik.joint_velocity();
    integrate(ik);
    expect_within_limits();
  }
  EXPECT_LE(acceleration, 30 + 1e-6);
  EXPECT_GT(acceleration, 1);
}

TEST_F(WholeBodyIkTest, OnlyActiveJointsMove) {
  const std::vector<int> active = {kinematics.dof_of("RShSag"), kinematics.dof_of("RElbj")};
  WholeBodyIk ik(kinematics, BaseMotion::kFixed, active, {});
  ik.start(q, kDt);
  ik.next_level();
  Eigen::Isometry3d X_WH = pose("r_hand_grasp");
  X_WH.translation() = Eigen::Vector3d(1, 0, 1);
  ik.track_pose(robot.model.link_index("r_hand_grasp"), Eigen::Vector3d::Zero(), X_WH, kStill(), 5);
  ik.track_joint(kinematics.dof_of("LElbj"), 0, 1);
  ASSERT_EQ(ik.solve(), QpStatus::kSolved);
  EXPECT_GT(ik.joint_velocity().norm(), 0.01);
  for (const int dof : all) {
    if (dof != active[0] && dof != active[1]) {
      EXPECT_EQ(ik.joint_velocity()[dof], 0);
    }
  }
}

TEST_F(WholeBodyIkTest, HalfSpacesBoundTheApproach) {
  WholeBodyIk ik(kinematics, BaseMotion::kFixed, all, {.velocity = 3, .acceleration = 1e4});
  const int hand = robot.model.link_index("r_hand_grasp");
  const Eigen::Vector3d n(0, 0, 1);
  Eigen::MatrixXd J(6, kinematics.dof());
  kinematics.jacobian(hand, Eigen::Vector3d::Zero(), J);
  ik.start(q, kDt);
  ik.next_level();
  Eigen::Matrix<double, 6, 1> down = kStill();
  down[5] = -0.3;
  ik.track_pose(hand, Eigen::Vector3d::Zero(), pose("r_hand_grasp"), down, 5);
  ik.keep_clear(hand, Eigen::Vector3d::Zero(), n, 0.05);
  ASSERT_EQ(ik.solve(), QpStatus::kSolved);
  EXPECT_NEAR((J * ik.joint_velocity())[5], -0.05, 1e-8);
}

TEST_F(WholeBodyIkTest, FailureIsNoMotion) {
  WholeBodyIk ik(kinematics, BaseMotion::kFixed, all, {});
  ik.start(q, kDt);
  ik.next_level();
  Eigen::Isometry3d X_WH = pose("r_hand_grasp");
  X_WH.translation().x() = std::nan("");
  ik.track_pose(robot.model.link_index("r_hand_grasp"), Eigen::Vector3d::Zero(), X_WH, kStill(), 5);
  EXPECT_EQ(ik.solve(), QpStatus::kNotConvex);
  EXPECT_EQ(ik.joint_velocity().norm(), 0);
}

}  // namespace
}  // namespace walkman::motion
