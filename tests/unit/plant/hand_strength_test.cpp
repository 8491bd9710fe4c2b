// Strength and stiffness of the hand. The strength is compared with published values for SoftHands: 20 and 28
// N on a cylinder of 45 mm with the first motors (Catalano et al., IJRR 33(5), 2014), 62 N for qb robotics'
// hand, 130 N at its peak in WALK-MAN's design document; and with the paper's robot, which held 1.7 N·m at
// the wrist. The stiffness with which a held object sits has never been measured: it is compared with the
// springs of pads, ligaments and tendon in parallel and in series, computed for the points where the hand
// touches.

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "adaptation/motion/grip.h"
#include "tests/unit/plant/hand_world.h"

namespace walkman::tests {
namespace {

constexpr double kRatedTorque = 5;  // N·m, of the motor

/// Reading of a force sensor between the halves of a cylinder of 45 mm.
double squeeze(double torque) {
  Grasp grasp;
  grasp.diameter = 0.045;
  grasp.length = 0.12;
  HandWorld world(grasp);
  world.run(3, torque);
  double sum = 0;
  for (int i = 0; i < 200; ++i) {
    world.step(torque);
    sum += world.squeeze() / 200;
  }
  return sum;
}

TEST(Strength, IsThatOfTheWalkManHandAtItsPeakAndOfOthersBelow) {
  EXPECT_NEAR(squeeze(kRatedTorque), 130, 30);
  const double half = squeeze(kRatedTorque / 2);
  EXPECT_GT(half, 28);
  EXPECT_LT(half, 62);
}

/// Position of a bar in a hand that has closed with a torque, has taken up its weight and been turned by half
/// a radian either way: into the palm (x) and towards the wrist (y), m.
Eigen::Vector2d seat_of(double diameter, double torque, double friction) {
  Grasp grasp;
  grasp.diameter = diameter;
  grasp.length = 1;
  grasp.mass = 1.2;
  grasp.friction = friction;
  HandWorld world(grasp);
  world.run(3, torque);
  constexpr int kSteps = 3000;
  double share = 0, angle = 0;
  for (const auto& [next_share, next_angle] :
       {std::pair{1.0, 0.0}, std::pair{1.0, -0.5}, std::pair{1.0, 0.5}, std::pair{1.0, 0.0}}) {
    for (int i = 1; i <= kSteps; ++i) {
      const double s = static_cast<double>(i) / kSteps, smooth = s * s * (3 - 2 * s);
      const double weight = grasp.mass * HandWorld::kGravity * (share + smooth * (next_share - share));
      const double turned = angle + smooth * (next_angle - angle);
      world.step(torque,
                 Eigen::AngleAxisd(turned, Eigen::Vector3d::UnitX()) * Eigen::Vector3d(0, 0, -weight));
    }
    share = next_share;
    angle = next_angle;
  }
  const Eigen::Vector3d p_PO = world.X_PO().translation();
  return {diameter / 2 - p_PO.y(), p_PO.z()};
}

// Compared with what the method assumes of handles (adaptation/motion/grip.h). A hand that begins to close
// moves a bar, farther the rougher it is; the hand frame is 7 mm in front of the palm's middle. Then its pads
// yield.
TEST(Seat, IsWhereTheMethodHasBars) {
  constexpr double kFrame = -0.007;   // m towards the wrist from the palm's middle
  constexpr double kUsualTorque = 1;  // N·m, adaptation/parameters.yaml
  constexpr std::array kDiameters = {0.06, 0.07, 0.08};
  constexpr std::array kSurfaces = {0.4, 0.6, 0.8};
  double depth = 0, square = 0;
  for (const double diameter : kDiameters) {
    SCOPED_TRACE(diameter);
    double mean = 0;
    for (const double friction : kSurfaces) {
      const double off =
          seat_of(diameter, kUsualTorque, friction).y() - kFrame - motion::Grip::seat(diameter / 2);
      EXPECT_NEAR(off, 0, 2 * motion::Grip::kSeatDeviation) << friction;
      mean += off / kSurfaces.size();
      square += off * off / (kSurfaces.size() * kDiameters.size());
    }
    EXPECT_NEAR(mean, 0, motion::Grip::kSeatDeviation);
    depth += seat_of(diameter, kRatedTorque, kSurfaces.back()).x() / kDiameters.size();
  }
  EXPECT_NEAR(std::sqrt(square), motion::Grip::kSeatDeviation, 0.25 * motion::Grip::kSeatDeviation);
  EXPECT_NEAR(depth, motion::Grip::kDepth, 0.0015);
}

/// A bar of 7 cm in the closed hand, to measure how far a small load moves it.
class HeldBar {
 public:
  HeldBar() : world_(bar()) { world_.run(3, kTorque); }
  /// Motion during 1.5 s under force (N) and torque (N·m), world axes, after 1.5 s without load; in the bar's
  /// frame before the load.
  Eigen::Isometry3d moved_by(const Eigen::Vector3d& f_W, const Eigen::Vector3d& t_W) {
    load(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
    const Eigen::Isometry3d before = world_.X_PO();
    load(f_W, t_W);
    return before.inverse() * world_.X_PO();
  }

  /// Compliance of its seat's springs, (m, rad) per (N, N·m), world axes.
  Eigen::Matrix<double, 6, 6> give(bool tendon_sticks) { return world_.stiffness(tendon_sticks).inverse(); }

 private:
  static constexpr double kTorque = kRatedTorque / 2;
  static Grasp bar() {
    Grasp grasp;
    grasp.length = 1.05;
    grasp.mass = 1.2;
    return grasp;
  }
  void load(const Eigen::Vector3d& f_W, const Eigen::Vector3d& t_W) {
    for (int i = 0; i < 1500; ++i) world_.step(kTorque, f_W, t_W);
  }
  HandWorld world_;
};

/// Expects `moved` per unit of load of a bar to lie between the values for its seat's springs with every
/// tendon sticking to its pulleys and with every one sliding. 5 % are allowed for the change of contact by
/// the load itself.
void expect_between(double moved, double sticking, double sliding, const char* unit, double per_unit) {
  std::printf("%.1f %s, by its springs %.1f to %.1f\n", per_unit / moved, unit, per_unit / sliding,
              per_unit / sticking);
  EXPECT_GT(moved, 0.95 * sticking);
  EXPECT_LT(moved, 1.05 * sliding);
}

TEST(Firmness, ABarGivesWayAsItsPadsAndTendonsDo) {
  HeldBar bar;
  double least = 1e9;  // N/m
  for (const Eigen::Vector3d& axis :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, -1)}) {
    SCOPED_TRACE(axis.transpose());
    const double moved = bar.moved_by(5 * axis, Eigen::Vector3d::Zero()).translation().norm() / 5;
    const auto by_springs = [&](bool sticks) {
      return (bar.give(sticks).topLeftCorner<3, 3>() * axis).norm();
    };
    expect_between(moved, by_springs(true), by_springs(false), "N/mm", 1e-3);
    least = std::min(least, 1 / moved);
  }
  EXPECT_NEAR(least, motion::Grip::kFirmness, 0.1 * motion::Grip::kFirmness);
}

TEST(Firmness, ABarTurnsByDegreesUnderTheMomentThePapersRobotHeld) {
  for (const Eigen::Vector3d& axis : {Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1)}) {
    HeldBar bar;
    const Eigen::Isometry3d X = bar.moved_by(Eigen::Vector3d::Zero(), 1.7 * axis);
    const double angle = Eigen::AngleAxisd(X.linear()).angle();
    const auto by_springs = [&](bool sticks) {
      return (bar.give(sticks).bottomRightCorner<3, 3>() * axis).norm();
    };
    expect_between(angle / 1.7, by_springs(true), by_springs(false), "N·m/rad", 1);
    EXPECT_LT(angle, 0.2) << axis.transpose();
    // It is held there and returns.
    EXPECT_LT(X.translation().norm(), 0.02) << axis.transpose();
  }
}

}  // namespace
}  // namespace walkman::tests
