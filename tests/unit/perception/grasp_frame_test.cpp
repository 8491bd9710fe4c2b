#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "adaptation/perception/stage_one.h"

namespace walkman::perception {
namespace {

// A camera looking down at a plane at 50°, and a handle across its image.
StageOneResult one_handle(const Eigen::Vector3d& axis) {
  StageOneResult result;
  result.plane.n_C = Eigen::Vector3d(0, -std::cos(50 * M_PI / 180), -std::sin(50 * M_PI / 180)).normalized();
  Handle handle;
  handle.p_CM = Eigen::Vector3d(0.1, 0, 0.8);
  handle.axis_C = axis.normalized();
  handle.radius = 0.03;
  handle.from = -0.3;
  handle.to = 0.3;
  handle.reach = 0.025;
  handle.places = {-0.28, -0.2, -0.19, 0.1, 0.29};
  result.objects.emplace_back().handles.push_back(handle);
  return result;
}

TEST(GraspFrame, AxesFollowThePaper) {
  const auto result = one_handle({1, 0.05, -0.2});
  const auto frame = grasp_frame_at(result, 0, 0.12);
  const Handle& handle = result.objects.front().handles.front();
  const Eigen::Matrix3d R = frame.X_CG.linear();
  EXPECT_TRUE(R.isUnitary(1e-12));
  EXPECT_TRUE(R.col(0).isApprox(handle.axis_C, 1e-12));
  EXPECT_NEAR(R.col(1).cross(handle.axis_C).dot(result.plane.n_C), 0, 1e-12)
      << "y lies in the plane of x and n_p";
  EXPECT_GT(R.col(1).dot(result.plane.n_C), 0.9);
  EXPECT_TRUE(R.col(2).isApprox(R.col(0).cross(R.col(1)), 1e-12));
  EXPECT_LT(R.col(2).z(), 0) << "z points to the sensor";
  EXPECT_TRUE(frame.X_CG.translation().isApprox(handle.p_CM + 0.12 * handle.axis_C + 0.03 * R.col(1), 1e-12));
  EXPECT_EQ(frame.handle, 0);
  EXPECT_DOUBLE_EQ(frame.along, 0.12);
}

TEST(GraspFrame, PositionIsClampedToTheHandle) {
  const auto result = one_handle({1, 0, 0});
  EXPECT_DOUBLE_EQ(grasp_frame_at(result, 0, 5).along, 0.3);
  EXPECT_DOUBLE_EQ(grasp_frame_at(result, 0, -5).along, -0.3);
  EXPECT_THROW(static_cast<void>(grasp_frame_at(result, 1, 0)), std::out_of_range);
  EXPECT_THROW(static_cast<void>(grasp_frame_at(result, -1, 0)), std::out_of_range);
}

TEST(GraspFrame, UprightHandleHasAFrameTowardsTheSensor) {
  auto result = one_handle({1, 0, 0});
  result.objects.front().handles.front().axis_C = result.plane.n_C;
  const auto frame = grasp_frame_at(result, 0, 0);
  EXPECT_TRUE(frame.X_CG.linear().isUnitary(1e-12));
  EXPECT_NEAR(frame.X_CG.linear().determinant(), 1, 1e-12);
  EXPECT_LT(frame.X_CG.linear().col(2).dot(result.objects.front().handles.front().p_CM), 0);
}

TEST(NearestGraspable, StaysWithinReachOfAShell) {
  const Handle handle = one_handle({1, 0, 0}).object().handles.front();
  EXPECT_DOUBLE_EQ(handle.nearest_graspable(0.11), 0.11);
  EXPECT_DOUBLE_EQ(handle.nearest_graspable(-0.1), -0.165);
  EXPECT_DOUBLE_EQ(handle.nearest_graspable(0), 0.075);
  EXPECT_DOUBLE_EQ(handle.nearest_graspable(0.18), 0.125);
  EXPECT_DOUBLE_EQ(handle.nearest_graspable(1), 0.3);
  EXPECT_DOUBLE_EQ(handle.nearest_graspable(-1), -0.3);
}

}  // namespace
}  // namespace walkman::perception
