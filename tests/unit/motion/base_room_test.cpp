#include "adaptation/motion/base_room.h"

#include <gtest/gtest.h>

#include "adaptation/motion/hand_motion.h"
#include "tests/unit/motion/reference_robot.h"

namespace walkman::motion {
namespace {

/// A standing robot whose hand is sent to targets beyond its arm's reach.
TEST(BaseRoom, HoldsTheBaseOfARobotThatReachesTooFar) {
  const ReferenceRobot& robot = reference_robot();
  HandMotion hand(robot.model, robot.joint_names, home_stance(), robot.right);
  const BaseRoomOptions& room = robot.right.base_room;
  for (const Eigen::Vector3d& far : {Eigen::Vector3d(1.6, -0.3, 0), Eigen::Vector3d(0.4, -1.7, 0),
                                     Eigen::Vector3d(0.5, -0.3, -1.0), Eigen::Vector3d(0.3, 1.2, 0.8)}) {
    hand.reset(robot.q_home);
    const Eigen::Isometry3d X_WB0 = hand.X_WB();
    Eigen::Isometry3d X_WH = hand.X_WH();
    X_WH.translation() = far;
    hand.go_to(X_WH, {});
    for (int i = 0; i < 12000 && !hand.done(); ++i) {
      hand.step(0.005);
      const Eigen::Vector3d gone = hand.X_WB().translation() - X_WB0.translation();
      const Eigen::Matrix3d turned = hand.X_WB().linear() * X_WB0.linear().transpose();
      constexpr double kSlack = 2e-3;
      ASSERT_LT(gone.head<2>().cwiseAbs().maxCoeff(), room.horizontal + kSlack) << far.transpose();
      ASSERT_LT(gone.z(), room.up + kSlack) << far.transpose();
      ASSERT_GT(gone.z(), -room.down - kSlack) << far.transpose();
      ASSERT_LT(std::abs(std::asin(turned(0, 2))), room.lean + kSlack) << far.transpose();
      ASSERT_LT(std::abs(std::asin(turned(1, 2))), room.lean + kSlack) << far.transpose();
      ASSERT_LT(std::abs(std::asin(turned(0, 1))), room.turn + kSlack) << far.transpose();
    }
    EXPECT_EQ(hand.status(), HandMotion::Status::kBlocked) << far.transpose();
  }
}

TEST(BaseRoom, SaysWhichBoundAndHowFar) {
  const BaseRoom room;
  EXPECT_EQ(room.describe(0), "the base is at its limit of 150 mm forward");
  EXPECT_EQ(room.describe(5), "the base is at its limit of 100 mm down");
  EXPECT_EQ(room.describe(6), "the base is leaning forward to its limit of 8.6 degrees");
}

}  // namespace
}  // namespace walkman::motion
