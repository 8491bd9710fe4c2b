#include "adaptation/regrasp/self_filter.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/unit/motion/reference_robot.h"

namespace walkman::regrasp {
namespace {

class SelfFilterTest : public testing::Test {
 protected:
  SelfFilterTest() : robot(motion::reference_robot()), posed(robot.model, robot.joint_names) {
    posed.update(robot.q_home);
    X_TC = posed.X_WL(robot.model.link_index("multisense/left_camera_optical_frame"));
  }

  /// Returns whether the filter keeps a point of T.
  bool stays(const Eigen::Vector3d& p_T) {
    camera::OrganizedCloud cloud;
    cloud.width = cloud.height = 1;
    cloud.points = {(X_TC.inverse() * p_T).cast<float>()};
    SelfFilter(robot.model).remove(posed, X_TC, cloud);
    return std::isfinite(cloud.points.front().x());
  }

  const motion::ReferenceRobot& robot;
  motion::KinematicTree posed;
  Eigen::Isometry3d X_TC;
};

TEST_F(SelfFilterTest, TakesThePointsOfAForearmAndWhatIsNextToIt) {
  // Its box in the URDF.
  const int link = robot.model.link_index("RForearm");
  const LinkGeometry& box = robot.model.links[static_cast<std::size_t>(link)].collisions.front();
  const Eigen::Vector3d half = std::get<BoxShape>(box.shape).size / 2;
  const Eigen::Isometry3d X_TS = posed.X_WL(link) * box.X_LG;
  EXPECT_FALSE(stays(X_TS * Eigen::Vector3d(half.x(), 0, 0)));
  EXPECT_FALSE(stays(X_TS * Eigen::Vector3d(half.x() + 0.029, 0, 0)));
  EXPECT_FALSE(stays(X_TS * Eigen::Vector3d(half.x(), -half.y() - 0.029, half.z())));
  EXPECT_TRUE(stays(X_TS * Eigen::Vector3d(half.x() + 0.031, 0, 0)));
  EXPECT_TRUE(stays(X_TS * Eigen::Vector3d(half.x() + 0.022, -half.y() - 0.022, 0)));
}

TEST_F(SelfFilterTest, GoesWithTheArm) {
  const int hand = robot.model.link_index("RSoftHandLink");
  const Eigen::Vector3d there = posed.X_WL(hand).translation();
  EXPECT_FALSE(stays(there));
  Eigen::VectorXd q = robot.q_home;
  q[posed.dof_of("RElbj")] += 0.8;
  posed.update(q);
  ASSERT_GT((posed.X_WL(hand).translation() - there).norm(), 0.2);
  EXPECT_TRUE(stays(there));
  EXPECT_FALSE(stays(posed.X_WL(hand).translation()));
}

TEST_F(SelfFilterTest, LeavesTheTableAndWhatIsNaN) {
  EXPECT_TRUE(stays({0.7, 0, -0.15}));
  EXPECT_FALSE(stays({std::nan(""), 0, 0}));
}

}  // namespace
}  // namespace walkman::regrasp
