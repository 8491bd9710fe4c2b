#include "adaptation/motion/trajectory.h"

#include <numbers>

#include <gtest/gtest.h>

namespace walkman::motion {
namespace {

Eigen::Isometry3d make_pose(const Eigen::Vector3d& p, double angle, const Eigen::Vector3d& axis) {
  Eigen::Isometry3d X(Eigen::AngleAxisd(angle, axis.normalized()));
  X.translation() = p;
  return X;
}

struct Peaks {
  double v = 0, w = 0, a = 0, alpha = 0;
};

Peaks peaks(const PoseTrajectory& path) {
  constexpr int kSamples = 4000;
  const double step = path.duration() / kSamples;
  Peaks peaks;
  for (int i = 0; i < kSamples; ++i) {
    const auto now = path.at(i * step);
    const auto next = path.at((i + 1) * step);
    peaks.v = std::max(peaks.v, now.V_W.tail<3>().norm());
    peaks.w = std::max(peaks.w, now.V_W.head<3>().norm());
    peaks.a = std::max(peaks.a, (next.V_W - now.V_W).tail<3>().norm() / step);
    peaks.alpha = std::max(peaks.alpha, (next.V_W - now.V_W).head<3>().norm() / step);
  }
  return peaks;
}

TEST(PoseTrajectory, StartsAndEndsAtRestOnItsPoses) {
  const Eigen::Isometry3d A = make_pose({0.1, 0.2, 0.3}, 0.4, {1, 0, 1});
  const Eigen::Isometry3d B = make_pose({0.5, -0.2, 0.6}, 2.0, {0, 1, 1});
  const PoseTrajectory path(A, B, {});
  EXPECT_TRUE(path.at(0).X_W.isApprox(A, 1e-12));
  EXPECT_TRUE(path.at(-1).X_W.isApprox(A, 1e-12));
  EXPECT_TRUE(path.at(path.duration() * (1 - 1e-9)).X_W.isApprox(B, 1e-12));
  EXPECT_TRUE(path.at(path.duration() + 1).X_W.isApprox(B, 1e-12));
  EXPECT_LT(path.at(0).V_W.norm(), 1e-12);
  EXPECT_LT(path.at(path.duration()).V_W.norm(), 1e-12);
}

TEST(PoseTrajectory, TouchesItsTightestLimitAndKeepsTheOthers) {
  const Eigen::Isometry3d A = Eigen::Isometry3d::Identity();
  const MotionLimits limits{0.25, 1.0, 0.5, 2.0};
  const Peaks far = peaks(PoseTrajectory(A, make_pose({2, 0, 0}, 0.1, {0, 0, 1}), limits));
  EXPECT_NEAR(far.v, limits.linear_velocity, 1e-6);
  EXPECT_LT(far.a, limits.linear_acceleration);
  const Peaks near = peaks(PoseTrajectory(A, make_pose({0, 0.02, 0}, 0.01, {0, 0, 1}), limits));
  EXPECT_NEAR(near.a, limits.linear_acceleration, 2e-3);
  EXPECT_LT(near.v, limits.linear_velocity);
  const Peaks turn = peaks(PoseTrajectory(A, make_pose({0, 0.02, 0}, 3.0, {0, 1, 1}), limits));
  EXPECT_NEAR(turn.w, limits.angular_velocity, 1e-6);
  EXPECT_LT(turn.alpha, limits.angular_acceleration);
}

TEST(PoseTrajectory, VelocityIsTheDerivativeOfThePose) {
  const PoseTrajectory path(make_pose({0.1, 0.2, 0.3}, 0.4, {1, 0, 1}),
                            make_pose({0.5, -0.2, 0.6}, 2.9, {0, 1, 1}), {});
  constexpr double kStep = 1e-5;
  for (const double part : {0.1, 0.35, 0.5, 0.8}) {
    const double time = part * path.duration();
    const auto before = path.at(time - kStep);
    const auto after = path.at(time + kStep);
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(after.X_W.linear() * before.X_W.linear().transpose()));
    const auto V = path.at(time).V_W;
    EXPECT_LT((V.head<3>() - turn.angle() * turn.axis() / (2 * kStep)).norm(), 1e-7);
    EXPECT_LT((V.tail<3>() - (after.X_W.translation() - before.X_W.translation()) / (2 * kStep)).norm(),
              1e-7);
  }
}

TEST(PoseTrajectory, TurnsTheShortWay) {
  const Eigen::Isometry3d A = make_pose({0, 0, 0}, 3.0, {0, 0, 1});
  const Eigen::Isometry3d B = make_pose({0, 0, 0}, -3.0, {0, 0, 1});
  const PoseTrajectory path(A, B, {});
  const Eigen::AngleAxisd half(Eigen::Matrix3d(path.at(path.duration() / 2).X_W.linear()));
  EXPECT_NEAR(half.angle(), std::numbers::pi, 1e-9);
  const PoseTrajectory nowhere(A, A, {});
  EXPECT_EQ(nowhere.duration(), 0);
  EXPECT_TRUE(nowhere.at(0).X_W.isApprox(A, 1e-12));
}

}  // namespace
}  // namespace walkman::motion
