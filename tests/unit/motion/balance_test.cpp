#include "adaptation/motion/balance.h"

#include <gtest/gtest.h>

#include "adaptation/motion/com_shift.h"
#include "adaptation/motion/hand_motion.h"
#include "tests/unit/motion/reference_robot.h"

namespace walkman::motion {
namespace {

const std::array<Eigen::Vector2d, 2> kMiddle{Eigen::Vector2d(0, 0.1), Eigen::Vector2d(0, -0.1)};

class BalanceTest : public testing::Test {
 protected:
  BalanceTest() : robot(reference_robot()), posed(robot.model, robot.joint_names), stance(robot.model) {
    q = robot.q_home;
    posed.update(q);
    stance.take(posed);
    place();
  }
  void place() {
    posed.update(q);
    posed.set_base(stance.X_TB(posed));
    posed.update(q);
  }
  /// Returns the readings of the foot sensors for these ground forces (N, in T) at these points of the
  /// ground.
  [[nodiscard]] std::array<FootLoad, Stance::kFeet> loads(const std::array<Eigen::Vector3d, 2>& force,
                                                          const std::array<Eigen::Vector2d, 2>& place) const {
    std::array<FootLoad, Stance::kFeet> feet;
    for (std::size_t i = 0; i < feet.size(); ++i) {
      feet[i].sensor_link = robot.model.link_index(i == 0 ? "l_leg_ft" : "r_leg_ft");
      const Eigen::Isometry3d& X_TS = posed.X_WL(feet[i].sensor_link);
      const double ground = stance.X_TF(static_cast<int>(i)).translation().z();
      const Eigen::Vector3d p_TP(place[i].x(), place[i].y(), ground);
      const Eigen::Matrix3d R_ST = X_TS.linear().transpose();
      feet[i].F_So_S = {R_ST * (p_TP - X_TS.translation()).cross(force[i]), R_ST * force[i]};
    }
    return feet;
  }

  const ReferenceRobot& robot;
  KinematicTree posed;
  Stance stance;
  Eigen::VectorXd q;
};

TEST_F(BalanceTest, CentreOfPressureIsTheLoadsMean) {
  const Eigen::Vector2d left(0.08, 0.19), right(-0.02, -0.11);
  const auto feet = loads({Eigen::Vector3d(30, -12, 700), Eigen::Vector3d(-5, 20, 450)}, {left, right});
  const BalanceReading reading = read_balance(posed, stance, feet, Eigen::Vector3d::UnitZ());
  EXPECT_LT((reading.p_Tcp - (700 * left + 450 * right) / 1150).norm(), 1e-9);
  EXPECT_LT((reading.force_T - Eigen::Vector2d(25, 8)).norm(), 1e-9);
  EXPECT_NEAR(reading.load[0], 700, 1e-9);
  EXPECT_NEAR(reading.load[1], 450, 1e-9);
  EXPECT_EQ(reading.p_Tcm, Eigen::Vector2d(posed.com().head<2>()));
}

TEST_F(BalanceTest, AtRestTheCentreOfPressureIsUnderTheCentreOfMass) {
  q[posed.dof_of("WaistSag")] = 0.2;
  q[posed.dof_of("WaistLat")] = -0.1;
  place();
  std::array<Eigen::Vector3d, 2> force;
  std::array<Eigen::Vector2d, 2> at;
  const auto supports = stance.supports(posed);
  for (std::size_t i = 0; i < 2; ++i) {
    force[i] = Eigen::Vector3d(0, 0, supports[i].force);
    at[i] = (posed.X_WL(stance.sole_link(static_cast<int>(i))) * supports[i].p_FP).head<2>();
  }
  const BalanceReading reading = read_balance(posed, stance, loads(force, at), Eigen::Vector3d::UnitZ());
  EXPECT_LT((reading.p_Tcp - reading.p_Tcm).norm(), 1e-9);
}

TEST_F(BalanceTest, ARobotThatRocksOnAnEdgeIsFollowedByItsInertialUnit) {
  const auto feet = loads({Eigen::Vector3d(0, 0, 500), Eigen::Vector3d(0, 0, 500)}, kMiddle);
  for (const auto& axis : {Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitX()}) {
    const Eigen::Matrix3d rocked = Eigen::AngleAxisd(0.02, axis).toRotationMatrix();
    const Eigen::Vector3d edge(0.16, 0.2, stance.X_TF(0).translation().z());
    const Eigen::Vector3d com = edge + rocked * (posed.com() - edge);
    const BalanceReading reading =
        read_balance(posed, stance, feet, rocked.transpose() * Eigen::Vector3d::UnitZ());
    EXPECT_GT((com - posed.com()).head<2>().norm(), 0.015);
    EXPECT_LT((reading.p_Tcm - com.head<2>()).norm(), 2e-4);
  }
}

TEST_F(BalanceTest, InTheAirThereIsNoCentreOfPressure) {
  const auto feet = loads({Eigen::Vector3d(1, 1, 3), Eigen::Vector3d(0, 0, -4)}, kMiddle);
  const BalanceReading reading = read_balance(posed, stance, feet, Eigen::Vector3d::UnitZ());
  EXPECT_EQ(reading.p_Tcp, reading.p_Tcm);
}

TEST_F(BalanceTest, ShiftMovesTheCentreOfMassAndNothingTurns) {
  ComShift shift(posed, stance);
  const KinematicTree before = posed;
  const Eigen::VectorXd q_before = q;
  Eigen::VectorXd dq(posed.dof());
  for (const double size : {0.04, 0.004}) {
    for (const Eigen::Vector2d& direction :
         {Eigen::Vector2d(1, 0), Eigen::Vector2d(0, -1), Eigen::Vector2d(-0.6, 0.8)}) {
      q = q_before;
      place();
      shift.offsets(size * direction, dq);
      q += dq;
      place();
      // To first order: the remaining error is quadratic in the size.
      const double left = 2 * size * size;
      const Eigen::Vector2d moved = posed.com().head<2>() - before.com().head<2>();
      EXPECT_LT((moved - size * direction).norm(), left);
      EXPECT_LT(rotation_error(posed.X_WB().linear(), before.X_WB().linear()).norm(), left);
      for (int foot = 0; foot < Stance::kFeet; ++foot) {
        const Eigen::Isometry3d& X_TF = posed.X_WL(stance.sole_link(foot));
        EXPECT_LT((X_TF.translation() - stance.X_TF(foot).translation()).norm(), left);
        EXPECT_LT(rotation_error(X_TF.linear(), stance.X_TF(foot).linear()).norm(), left);
      }
      EXPECT_EQ(dq[posed.dof_of("RElbj")], 0);
      EXPECT_EQ(dq[posed.dof_of("WaistSag")], 0);
    }
  }
}

TEST_F(BalanceTest, ShiftKnowsThePayload) {
  posed.set_payload(20, robot.model.link_index("r_hand_grasp"), Eigen::Vector3d::Zero());
  place();
  ComShift shift(posed, stance);
  const Eigen::Vector2d before = posed.com().head<2>();
  Eigen::VectorXd dq(posed.dof());
  shift.offsets(Eigen::Vector2d(0.004, 0), dq);
  q += dq;
  place();
  EXPECT_LT((posed.com().head<2>() - before - Eigen::Vector2d(0.004, 0)).norm(), 4e-5);
}

TEST_F(BalanceTest, StretchedKneesDoNotRace) {
  for (const char* side : {"L", "R"}) {
    const std::string s = side;
    q[posed.dof_of(s + "KneeSag")] = 0;
    q[posed.dof_of(s + "HipSag")] = 0;
    q[posed.dof_of(s + "AnkSag")] = 0;
  }
  place();
  ComShift shift(posed, stance);
  Eigen::VectorXd dq(posed.dof());
  shift.offsets(Eigen::Vector2d(0.04, 0.04), dq);
  EXPECT_TRUE(dq.allFinite());
  EXPECT_LT(dq.cwiseAbs().maxCoeff(), 0.2);
}

TEST_F(BalanceTest, ShiftIsOfTheSetPointsNotOfTheReference) {
  HandMotion motion(robot.model, robot.joint_names, stance, robot.right);
  motion.reset(q);
  for (int i = 0; i < 1000; ++i) motion.step(0.005);
  const Eigen::VectorXd reference = motion.q_ref();
  motion.shift_com(Eigen::Vector2d(0.01, -0.005));
  const auto& commands = motion.step(0.005);
  EXPECT_LT((motion.q_ref() - reference).norm(), 1e-6);
  for (std::size_t i = 0; i < commands.size(); ++i)
    q[static_cast<Eigen::Index>(i)] = commands[i].link_position;
  place();
  const Eigen::Vector2d moved = posed.com().head<2>() - motion.kinematics().com().head<2>();
  EXPECT_LT((moved - Eigen::Vector2d(0.01, -0.005)).norm(), 3e-4);
}

}  // namespace
}  // namespace walkman::motion
