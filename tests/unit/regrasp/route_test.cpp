#include "adaptation/regrasp/route.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/motion/reference_robot.h"

namespace walkman::regrasp {
namespace {

using motion::HandMotion;
using motion::palm_down;

class RouteTest : public testing::TestWithParam<double> {
 protected:
  RouteTest()
      : robot(motion::reference_robot()),
        hand(robot.model, robot.joint_names, robot.X_WB, side() < 0 ? robot.right : robot.left) {
    hand.reset(robot.q_home);
  }

  double side() const { return GetParam(); }
  void put_table(double height) {
    hand.set_obstacles({{"the table", motion::ConvexPrism(Eigen::Vector3d::UnitZ(), {{0.5, -0.9, height},
                                                                                     {1.3, -0.9, height},
                                                                                     {1.3, 0.9, height},
                                                                                     {0.5, 0.9, height}})}});
  }
  /// Follows the route and returns its minimum distance from the table.
  double follow(const Route& route) {
    double nearest = hand.obstacle_clearance();
    for (const Eigen::Isometry3d& X_WV : route.way) {
      hand.go_to(X_WV, {});
      while (!hand.done()) {
        hand.step(0.005);
        nearest = std::min(nearest, hand.obstacle_clearance());
      }
      EXPECT_EQ(hand.status(), HandMotion::Status::kReached) << hand.describe();
    }
    return nearest;
  }

  const motion::ReferenceRobot& robot;
  HandMotion hand;
};

TEST_P(RouteTest, GoesStraightWhereNothingIsInTheWay) {
  const Eigen::Isometry3d goal = palm_down(0.45, side() * 0.4, 1.15);
  const Route route = find_route(hand, std::span(&goal, 1), {}, 0);
  EXPECT_EQ(route.reach.status, HandMotion::Status::kReached);
  ASSERT_EQ(route.way.size(), 1);
  EXPECT_TRUE(route.way.front().isApprox(goal));
}

TEST_P(RouteTest, GoesRoundTheEdgeOfATable) {
  for (const double height : {0.90, 0.97}) {
    hand.reset(robot.q_home);
    put_table(height);
    const Eigen::Isometry3d goal = palm_down(0.657, side() * 0.3, height + 0.2);
    ASSERT_NE(hand.reachable(goal, {}).status, HandMotion::Status::kReached) << height;
    const Route route = find_route(hand, std::span(&goal, 1), {}, 0);
    ASSERT_EQ(route.reach.status, HandMotion::Status::kReached) << height << ": " << route.reach.reason;
    EXPECT_GT(route.way.size(), 1);
    EXPECT_TRUE(route.way.back().isApprox(goal));
    EXPECT_GT(follow(route), 0.01);
    EXPECT_LT((hand.X_WH().translation() - goal.translation()).norm(), 1e-3);
  }
}

// Whether a detour is found depends on millimetres; the one that led to a place leads to its neighbour too.
TEST_P(RouteTest, TakesTheWayThatLedNearbyBefore) {
  put_table(0.97);
  const Eigen::Isometry3d goal = palm_down(0.657, side() * 0.3, 1.17);
  const Route before = find_route(hand, std::span(&goal, 1), {}, 0);
  ASSERT_EQ(before.reach.status, HandMotion::Status::kReached);
  const std::span<const Eigen::Isometry3d> led(before.way.data(), before.way.size() - 1);
  ASSERT_FALSE(led.empty());
  const Eigen::Isometry3d beside = palm_down(0.657, side() * 0.33, 1.17);
  const Route route = find_route(hand, std::span(&beside, 1), {}, 0, led);
  ASSERT_EQ(route.reach.status, HandMotion::Status::kReached);
  ASSERT_EQ(route.way.size(), before.way.size());
  for (std::size_t i = 0; i < led.size(); ++i) EXPECT_TRUE(route.way[i].isApprox(led[i])) << i;
  EXPECT_TRUE(route.way.back().isApprox(beside));
  const Route anew = find_route(hand, std::span(&beside, 1), {}, 0);
  EXPECT_FALSE(anew.way.size() == route.way.size() && anew.way[led.size() - 1].isApprox(led.back()));
}

TEST_P(RouteTest, SaysWhatStopsTheStraightWayWhereNoneHelps) {
  put_table(0.90);
  const Eigen::Isometry3d goal = palm_down(0.65, side() * 0.3, 0.85);
  const Route route = find_route(hand, std::span(&goal, 1), {}, 0);
  EXPECT_EQ(route.reach.status, HandMotion::Status::kBlocked);
  EXPECT_THAT(route.reach.reason, testing::HasSubstr("the table would touch"));
  EXPECT_EQ(route.way.size(), 1);
}

INSTANTIATE_TEST_SUITE_P(BothHands, RouteTest, testing::Values(-1.0, 1.0));

}  // namespace
}  // namespace walkman::regrasp
