// The load that pulls a bar out of the hand: a force or a moment that rises slowly until the bar is lost.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <utility>

#include <gtest/gtest.h>

#include "tests/unit/plant/hand_world.h"

namespace walkman::tests {
namespace {

constexpr double kTensions[] = {20, 40, 60};  // N
constexpr double kFrictions[] = {0.4, 0.7, 1.0};

enum class Load {
  kAlongTheBar,   ///< force along the bar's axis
  kOutOfThePalm,  ///< force away from the palm
  kTilt,          ///< moment that tilts one end of the bar away from the palm, as an off-centre weight does
};

/// Result of loading a bar until it is lost.
struct Overload {
  double grip = 0;  ///< mean sum of normal forces while it slid, over 10 to 20 mm, N
  double friction =
      0;  ///< mean friction along its axis over that range: load minus mass times acceleration, N
  double at_slip = 0;    ///< load when it had moved by 20 mm, or turned by 0.4 rad; N or N·m
  double displaced = 0;  ///< displacement at that time, from poses, m or rad
  double counted = 0;    ///< slip counted by the plant over the same time, m or rad
  bool lost = false;     ///< the hand finally lost contact with it
};

Overload overload(Load kind, double tension, double friction) {
  constexpr double kLimit[] = {0.02, 0.02, 0.4};
  const bool moment = kind == Load::kTilt;
  const double limit = kLimit[static_cast<int>(kind)];
  const double torque = tension * kPulley;
  Grasp grasp;
  grasp.friction = friction;
  HandWorld world(grasp);
  world.run(2, torque);
  const Eigen::Isometry3d start = world.X_PO();
  const plant::Slip before = world.slip();
  Overload result;
  int sliding = 0;
  double x = start.translation().x();
  double speed = 0;  // along the bar's axis, m/s
  // Reaches the limit in about 1 s.
  const double rate = 5 * tension * friction * (moment ? 0.06 : 1);
  for (int i = 0; i < 6000 && !result.lost; ++i) {
    const double load = rate * i * HandWorld::kStep;
    Eigen::Vector3d f_W = Eigen::Vector3d::Zero();
    Eigen::Vector3d t_W = Eigen::Vector3d::Zero();
    if (kind == Load::kAlongTheBar) f_W.x() = load;
    if (kind == Load::kOutOfThePalm) f_W.z() = -load;
    if (kind == Load::kTilt) t_W.y() = load;
    world.step(torque, f_W, t_W);
    const Eigen::Isometry3d moved = start.inverse() * world.X_PO();
    const double by = moment ? Eigen::AngleAxisd(moved.linear()).angle() : moved.translation().norm();
    const double last_speed = speed;
    speed = (world.X_PO().translation().x() - x) / HandWorld::kStep;
    x = world.X_PO().translation().x();
    if (result.at_slip == 0 && by > 0.5 * limit && by < limit) {
      result.grip += world.grip();
      // The right palm's x is the world's.
      result.friction += load - grasp.mass * (speed - last_speed) / HandWorld::kStep;
      ++sliding;
    }
    if (result.at_slip == 0 && by > limit) {
      result.at_slip = load;
      result.displaced = by;
      result.counted = moment ? world.slip().turn - before.turn : world.slip().travel - before.travel;
      if (sliding > 0) {
        result.grip /= sliding;
        result.friction /= sliding;
      }
    }
    result.lost = !world.slip().held && result.at_slip > 0;
  }
  return result;
}

/// Overloads for all tensions and frictions, printed.
std::map<std::pair<int, int>, Overload> sweep(Load kind, const char* title) {
  std::map<std::pair<int, int>, Overload> table;
  std::printf("%s\n  tendon N  friction  slips at  grip N  lost\n", title);
  for (int t = 0; t < 3; ++t) {
    for (int m = 0; m < 3; ++m) {
      const Overload o = overload(kind, kTensions[t], kFrictions[m]);
      std::printf("  %8.0f  %8.1f  %8.2f  %6.1f  %s\n", kTensions[t], kFrictions[m], o.at_slip, o.grip,
                  o.lost ? "yes" : "no");
      table[{t, m}] = o;
    }
  }
  return table;
}

void expect_the_trend(const std::map<std::pair<int, int>, Overload>& table) {
  for (const auto& [at, o] : table) {
    SCOPED_TRACE(testing::Message() << kTensions[at.first] << " N, friction " << kFrictions[at.second]);
    EXPECT_TRUE(o.lost);
    EXPECT_GT(o.at_slip, 0);
    if (at.first > 0) {
      EXPECT_GT(o.at_slip, 1.15 * table.at({at.first - 1, at.second}).at_slip);
    }
    if (at.second > 0) {
      EXPECT_GT(o.at_slip, 1.05 * table.at({at.first, at.second - 1}).at_slip);
    }
  }
}

TEST(Overload, AlongTheBarItIsCoulombs) {
  const auto table = sweep(Load::kAlongTheBar, "Force along the bar, N");
  expect_the_trend(table);
  for (const auto& [at, o] : table) {
    SCOPED_TRACE(testing::Message() << kTensions[at.first] << " N, friction " << kFrictions[at.second]);
    // Every contact slides along the bar, so the holding force is the coefficient times the sum of normal
    // forces.
    EXPECT_NEAR(o.friction / (kFrictions[at.second] * o.grip), 1, 0.1);
    // The plant's count is the distance that the bar slid.
    EXPECT_GT(o.counted, 0.9 * o.displaced);
    EXPECT_LT(o.counted, 1.3 * o.displaced);  // it is a path length: a detour counts
  }
  for (int t = 0; t < 3; ++t) {
    EXPECT_NEAR(table.at({t, 2}).at_slip / table.at({t, 0}).at_slip, 1.0 / 0.4, 0.25 / 0.4);
  }
  for (int m = 0; m < 3; ++m) {
    // A straight line over the tension: the ligaments and the tendon's losses take up the first newtons of
    // each tension.
    const double lower = table.at({1, m}).at_slip - table.at({0, m}).at_slip;
    const double upper = table.at({2, m}).at_slip - table.at({1, m}).at_slip;
    EXPECT_NEAR(upper / lower, 1, 0.35);
  }
}

// WALK-MAN's design document states a grasp force of 130 N at the motor's peak: fingers and palm each press
// with that force, from either side.
TEST(Overload, AtTheMotorsPeakABarIsHeldAsThePublishedForceHoldsIt) {
  const Overload o = overload(Load::kAlongTheBar, 5 / kPulley, 0.7);
  std::printf("at 5 N·m and friction 0.7 a bar slips along the fingers at %.0f N\n", o.at_slip);
  EXPECT_NEAR(o.at_slip, 2 * 0.7 * 130, 0.2 * 2 * 0.7 * 130);
}

TEST(Overload, OutOfThePalmItRisesWithTensionAndFriction) {
  expect_the_trend(sweep(Load::kOutOfThePalm, "Force out of the palm, N"));
}

TEST(Overload, MomentOfAnOffCentreWeightRisesWithTensionAndFriction) {
  const auto table = sweep(Load::kTilt, "Moment that tilts the bar, N·m");
  expect_the_trend(table);
}

}  // namespace
}  // namespace walkman::tests
