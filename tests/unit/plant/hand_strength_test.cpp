// How strong and how firm the hand is, beside what is published of SoftHands: 20 and 28 N on a cylinder of 45
// mm with the first motors (Catalano et al., IJRR 33(5), 2014), 62 N of qb robotics' hand, 130 N at its peak
// in WALK-MAN's design document; and beside the paper's robot, which held 1.7 N·m at the wrist. Nobody has
// measured how soft a held object sits; estimates go from 3 N/mm and 3 N·m/rad, tendon and pads in series, to
// 30 of each for the pads of a firm grip alone. With pads of half the 2 N/mm the bar sits half as firm, but
// the fingers sink so deep into it that of the 130 N there are 91.

#include <cmath>

#include <gtest/gtest.h>

#include "tests/unit/plant/hand_world.h"

namespace walkman::tests {
namespace {

constexpr double kRatedTorque = 5;  // N·m, of the motor

/// What a force sensor between the halves of a cylinder of 45 mm reads.
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

/// A bar of 7 cm in the closed hand, and how far a small load moves it.
class HeldBar {
 public:
  HeldBar() : world_(bar()) { world_.run(3, kTorque); }
  /// Of 1.5 s under force (N) and torque (N·m), world axes, after 1.5 s without; in the bar's frame before.
  Eigen::Isometry3d moved_by(const Eigen::Vector3d& f_W, const Eigen::Vector3d& t_W) {
    load(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
    const Eigen::Isometry3d before = world_.X_PO();
    load(f_W, t_W);
    return before.inverse() * world_.X_PO();
  }

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

TEST(Firmness, ABarGivesWayByAFractionOfAMillimetrePerNewton) {
  HeldBar bar;
  for (const Eigen::Vector3d& axis :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, -1)}) {
    const double stiffness = 5 / bar.moved_by(5 * axis, Eigen::Vector3d::Zero()).translation().norm();
    std::printf("along (%.0f, %.0f, %.0f): %.1f N/mm\n", axis.x(), axis.y(), axis.z(), 1e-3 * stiffness);
    EXPECT_GT(stiffness, 3e3) << axis.transpose();  // N/m
    EXPECT_LT(stiffness, 25e3) << axis.transpose();
  }
}

TEST(Firmness, ABarTurnsByDegreesUnderTheMomentThePapersRobotHeld) {
  for (const Eigen::Vector3d& axis : {Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1)}) {
    HeldBar bar;
    const Eigen::Isometry3d X = bar.moved_by(Eigen::Vector3d::Zero(), 1.7 * axis);
    const double angle = Eigen::AngleAxisd(X.linear()).angle();
    std::printf("about (%.0f, %.0f, %.0f): %.1f N·m/rad\n", axis.x(), axis.y(), axis.z(), 1.7 / angle);
    EXPECT_LT(angle, 0.2) << axis.transpose();
    EXPECT_LT(1.7 / angle, 60) << axis.transpose();  // the palm's two lines of contact take part
    // It is held there, and comes back.
    EXPECT_LT(X.translation().norm(), 0.02) << axis.transpose();
  }
}

}  // namespace
}  // namespace walkman::tests
