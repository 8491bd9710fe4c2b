#include "adaptation/regrasp/grasp_planner.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "adaptation/regrasp/observer.h"
#include "tests/unit/motion/reference_robot.h"

namespace walkman::regrasp {
namespace {

constexpr double kTable = -0.15;         // m, height of its top in T, the base's frame
constexpr double kPlaceDistance = 0.01;  // m

/// A robot whose base is held, in its home posture, and a round bar on a table in front of it, across its
/// view.
class GraspPlannerTest : public testing::Test {
 protected:
  GraspPlannerTest()
      : home(motion::reference_robot()),
        known(load_robot_description("urdf/walkman.robot.yaml")),
        planner(known, home.joint_names, std::nullopt, parameters) {
    motion::KinematicTree posed(known.model, home.joint_names);
    posed.update(home.q_home);
    X_TC = posed.X_WL(known.model.link_index(known.description.optical_frame));
    seen.plane.n_C = X_TC.linear().transpose().col(2);
    seen.plane.offset = -seen.plane.n_C.dot(in_C({0.8, 0, kTable}));
    table_T = {{0.45, -0.8, kTable}, {1.25, -0.8, kTable}, {1.25, 0.8, kTable}, {0.45, 0.8, kTable}};
  }

  Eigen::Vector3d in_C(const Eigen::Vector3d& p_T) const { return X_TC.inverse() * p_T; }

  void put_bar(double x, double y, double radius, double half_length = 0.35) {
    seen.objects.assign(1, {});
    perception::SeenObject& bar = seen.objects.front();
    perception::Handle handle;
    handle.p_CM = in_C({x, y, kTable + radius});
    handle.axis_C = X_TC.linear().transpose() * -Eigen::Vector3d::UnitY();
    handle.radius = radius;
    handle.from = -half_length;
    handle.to = half_length;
    handle.reach = kPlaceDistance;
    const int places = static_cast<int>(half_length / kPlaceDistance);
    for (int place = -places; place <= places; ++place) {
      const double along = place * kPlaceDistance;
      handle.places.push_back(along);
      for (int step = 0; step <= 16; ++step) {
        const double angle = std::numbers::pi * step / 16;
        bar.surface_C.push_back(
            in_C({x + radius * std::cos(angle), y - along, kTable + radius + radius * std::sin(angle)})
                .cast<float>());
      }
    }
    bar.p_CCm = handle.p_CM;
    bar.handles = {handle};
  }

  /// Adds a wall of points on the table, along x.
  void put_wall(double y, double height) {
    perception::SeenObject& wall = seen.objects.emplace_back();
    for (int i = 0; i < 20; ++i)
      for (int k = 0; 0.01 * k < height; ++k)
        wall.surface_C.push_back(in_C({0.60 + 0.01 * i, y, kTable + 0.01 * k}).cast<float>());
  }

  /// Plans a grasp at the place on the bar nearest to y.
  PlannedGrasp plan(double y, double nearer_than = std::numeric_limits<double>::infinity(),
                    const std::vector<GraspPlanner::Blocked>& blocked = {}) {
    GraspPlanner::View view{&seen, X_TC, {}, home.q_home, home.q_home, blocked};
    view.obstacles = {{"the table", motion::ConvexPrism(Eigen::Vector3d::UnitZ(), table_T)}};
    return planner.plan(
        view,
        [&](const perception::Handle& handle, double along) {
          return std::abs((X_TC * (handle.p_CM + along * handle.axis_C)).y() - y);
        },
        nearer_than);
  }

  const motion::ReferenceRobot& home;
  KnownRobot known;
  MethodParameters parameters;
  GraspPlanner planner;
  Eigen::Isometry3d X_TC;
  perception::StageOneResult seen;
  std::vector<Eigen::Vector3d> table_T;
};

TEST_F(GraspPlannerTest, EitherSideIsItsOwnHandsAndThePlaceIsTheOneAskedFor) {
  for (const double y : {-0.35, 0.35}) {
    put_bar(0.65, y, 0.035);
    const PlannedGrasp grasp = plan(y + 0.1);
    EXPECT_EQ(known.description.hands[grasp.hand].name, y < 0 ? "right" : "left");
    EXPECT_LT(grasp.cost, 0.002);
    EXPECT_EQ(grasp.cost, grasp.least_cost);
    EXPECT_EQ(grasp.refusal, "");
    const Eigen::Vector3d p_TG = grasp.X_TG.translation();
    EXPECT_NEAR(p_TG.y(), y + 0.1, 0.002);
    // On the bar's surface, with the handle along x.
    EXPECT_NEAR(std::hypot(p_TG.x() - 0.65, p_TG.z() - kTable - 0.035), 0.035, 1e-6);
    EXPECT_NEAR(std::abs(grasp.X_TG.linear().col(0).y()), 1, 1e-6);
    EXPECT_NEAR((grasp.X_TH.translation() - p_TG).norm(), parameters.stage_two.palm_clearance, 1e-9);
    EXPECT_NEAR((grasp.way.back().translation() - p_TG).norm(), parameters.stage_two.approach_height, 1e-9);
  }
}

TEST_F(GraspPlannerTest, WhatItPlansTheHandCanDo) {
  put_bar(0.65, -0.3, 0.035);
  PlannedGrasp grasp = plan(-0.3);
  motion::HandMotion hand(known.model, home.joint_names, Eigen::Isometry3d::Identity(),
                          grasp.hand == 0 ? home.right : home.left);
  hand.reset(home.q_home);
  hand.set_obstacles({{"the table", motion::ConvexPrism(Eigen::Vector3d::UnitZ(), table_T)}});
  grasp.way.push_back(grasp.X_TH);
  for (const Eigen::Isometry3d& X_TH : grasp.way) {
    hand.go_to(X_TH, {});
    while (!hand.done()) {
      hand.step(0.005);
      EXPECT_GT(hand.own_clearance(), 0.005);
      EXPECT_GT(hand.obstacle_clearance(), 0.01);
    }
    ASSERT_EQ(hand.status(), motion::HandMotion::Status::kReached) << hand.describe();
  }
}

TEST_F(GraspPlannerTest, KeepsTheWholeHandOffWhatStandsBesideTheHandle) {
  put_bar(0.65, -0.3, 0.035);
  put_wall(-0.3, 0.15);
  const PlannedGrasp grasp = plan(-0.3);
  // The palm is about 10 cm wide: beside the wall there is room for half of it.
  EXPECT_GT(grasp.cost, 0.03);
  EXPECT_LT(grasp.cost, 0.15);
  EXPECT_LT(grasp.least_cost, 0.002);
  EXPECT_THAT(grasp.refusal,
              testing::ContainsRegex(
                  "right hand: R.* and what lies beside the handle would touch, [0-9.]+ mm too near"));
}

/// Compared with places tried one by one, each as the wanted one.
TEST_F(GraspPlannerTest, IsAsNearToTheWantedPlaceAsTheHandFits) {
  put_bar(0.65, -0.3, 0.035);
  put_wall(-0.3, 0.15);
  constexpr double kStep = 0.002;  // m
  const double found = plan(-0.3).X_TG.translation().y() + 0.3;
  double nearest = 0.03;
  while (nearest < 0.15 && plan(-0.3 + std::copysign(nearest, found)).cost > kStep / 4) nearest += kStep;
  EXPECT_NEAR(std::abs(found), nearest, 1.5 * kStep);
}

/// Between walls, the palm of 11 cm has only the rest of their distance as clearance; the next place with
/// more clearance is beyond one of them.
TEST_F(GraspPlannerTest, TakesLittleRoomWhereMoreWouldBeFarOff) {
  put_bar(0.65, -0.3, 0.035);
  constexpr double kBetween = 0.1185;  // 4 mm on both sides
  put_wall(-0.3 - kBetween / 2, 0.15);
  put_wall(-0.3 + kBetween / 2, 0.15);
  EXPECT_LT(plan(-0.3).cost, 0.004);
}

TEST_F(GraspPlannerTest, TakesMoreRoomThatIsNotFarOff) {
  put_bar(0.65, -0.3, 0.035);
  put_wall(-0.3 + 0.055 + 0.004, 0.15);
  const PlannedGrasp grasp = plan(-0.3);
  EXPECT_GT(grasp.cost, 0.001);
  EXPECT_LT(grasp.cost, 0.006);
}

TEST_F(GraspPlannerTest, RefusesWhatIsNotNearerThanAskedFor) {
  put_bar(0.65, -0.3, 0.035);
  put_wall(-0.3, 0.15);
  EXPECT_THAT([&] { static_cast<void>(plan(-0.3, 0.03)); },
              testing::ThrowsMessage<RunStopped>(
                  testing::HasSubstr("no hand can grasp the object within 30 mm of its centre of mass")));
  EXPECT_LT(plan(-0.3, 0.15).cost, 0.15);
}

TEST_F(GraspPlannerTest, WhereTheWayWasBlockedAnotherPlaceIsNext) {
  put_bar(0.65, -0.3, 0.035);
  const PlannedGrasp first = plan(-0.3);
  const std::size_t other = 1 - first.hand;
  const PlannedGrasp same = plan(-0.3, 1, {{other, first.X_TG.translation(), "a knee"}});
  EXPECT_EQ(same.hand, first.hand);
  EXPECT_EQ(same.X_TG.matrix(), first.X_TG.matrix());
  const PlannedGrasp next = plan(-0.3, 1, {{first.hand, first.X_TG.translation(), "an elbow"}});
  const double apart = (next.X_TG.translation() - first.X_TG.translation()).norm();
  EXPECT_TRUE(next.hand == other || apart > parameters.stage_two.displacement_threshold) << apart;
  EXPECT_LT(apart, 0.05);
  EXPECT_THAT(next.refusal, testing::HasSubstr("an elbow"));
}

TEST_F(GraspPlannerTest, OpenFingersDoNotFitRoundABarThatLiesLow) {
  put_bar(0.65, -0.3, 0.02);
  EXPECT_THAT([&] { static_cast<void>(plan(-0.3)); },
              testing::ThrowsMessage<RunStopped>(
                  testing::ContainsRegex("right hand: R(Finger|Thumb).* and the table would touch, [0-9.]+ "
                                         "mm too near; the left hand: .*")));
}

TEST_F(GraspPlannerTest, SaysHowFarEachHandIsFromABarOutOfReach) {
  put_bar(1.6, -0.3, 0.035, 0.02);
  EXPECT_THAT([&] { static_cast<void>(plan(-0.3)); },
              testing::ThrowsMessage<RunStopped>(testing::ContainsRegex(
                  "right hand: .* the hand ends [0-9.]+ mm and .*; the left hand: .* mm")));
}

}  // namespace
}  // namespace walkman::regrasp
