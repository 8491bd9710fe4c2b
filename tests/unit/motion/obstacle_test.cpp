#include "adaptation/motion/obstacle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/motion/reference_robot.h"

namespace walkman::motion {
namespace {

const std::vector<Eigen::Vector3d> kTable = {{1.3, 0.8, 0.9}, {0.5, -0.8, 0.9}, {0.9, 0.1, 0.9},
                                             {0.5, 0.8, 0.9}, {1.3, -0.8, 0.9}, {0.7, -0.8, 0.9}};

TEST(ConvexPrism, IsTheColumnBelowTheHullOfItsPoints) {
  const ConvexPrism table(Eigen::Vector3d(0, 0, 3), kTable);
  EXPECT_EQ(table.faces().size(), 5U);
  EXPECT_NEAR(table.distance({0.8, 0, 1.0}), 0.10, 1e-12);
  EXPECT_NEAR(table.distance({0.8, 0, 0.88}), -0.02, 1e-12);
  EXPECT_NEAR(table.distance({0.45, 0, 0.2}), 0.05, 1e-12);
  EXPECT_NEAR(table.distance({0.9, 0.85, -5}), 0.05, 1e-12);
  EXPECT_NEAR(table.distance({0.53, 0, 0.2}), -0.03, 1e-12);
  const ConvexPrism::Face& front = table.separating_face({0.3, 0, 0.95});
  EXPECT_LT((front.n_W - Eigen::Vector3d(-1, 0, 0)).norm(), 1e-12);
  EXPECT_NEAR(front.offset, -0.5, 1e-12);
}

TEST(ConvexPrism, FollowsATiltedTop) {
  const Eigen::AngleAxisd tilt(0.3, Eigen::Vector3d::UnitY());
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3d& p : kTable) points.push_back(tilt * p);
  const ConvexPrism table(tilt * Eigen::Vector3d::UnitZ(), points);
  EXPECT_NEAR(table.distance(tilt * Eigen::Vector3d(0.8, 0, 1.0)), 0.10, 1e-12);
  EXPECT_NEAR(table.distance(tilt * Eigen::Vector3d(0.45, 0, 0.2)), 0.05, 1e-12);
}

TEST(ConvexPrism, RejectsWhatHasNoArea) {
  const auto message_for = [](const Eigen::Vector3d& normal,
                              const std::vector<Eigen::Vector3d>& points) -> std::string {
    try {
      const ConvexPrism prism(normal, points);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  EXPECT_THAT(message_for(up, {{0, 0, 0}, {1, 0, 0}}), testing::HasSubstr("2 points"));
  EXPECT_THAT(message_for(up, {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}), testing::HasSubstr("on a line"));
  EXPECT_THAT(message_for(Eigen::Vector3d::Zero(), kTable), testing::HasSubstr("without direction"));
  EXPECT_THAT(message_for(up, {{0, 0, 0}, {1, 0, 0}, {2, std::nan(""), 0}}),
              testing::HasSubstr("not finite"));
}

TEST(Guards, CoverTheArmsCollisionBoxes) {
  const ReferenceRobot& robot = reference_robot();
  KinematicTree kinematics(robot.model, robot.joint_names);
  kinematics.set_base(robot.X_WB);
  kinematics.update(robot.q_home);
  const auto guards = right_arm_guards(robot.model);
  // A plane that just touches the lowest palm corner, seen from the box in the URDF, must be within a
  // finger's breadth of what the guards report.
  const Link& hand = robot.model.links[static_cast<std::size_t>(robot.model.link_index("RSoftHandLink"))];
  double lowest = 10;
  for (const LinkGeometry& geometry : hand.collisions) {
    const auto* box = std::get_if<BoxShape>(&geometry.shape);
    ASSERT_NE(box, nullptr);
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d sign(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, corner & 4 ? 0.5 : -0.5);
      const Eigen::Vector3d p = kinematics.X_WL(robot.model.link_index("RSoftHandLink")) *
                                (geometry.X_LG * sign.cwiseProduct(box->size));
      lowest = std::min(lowest, p.z());
    }
  }
  const ConvexPrism floor(Eigen::Vector3d::UnitZ(), {{-5, -5, 0}, {5, -5, 0}, {5, 5, 0}, {-5, 5, 0}});
  EXPECT_NEAR(clearance(kinematics, guards, floor), lowest, 0.01);
}

TEST(Guards, KeepTheArmFromTheTrunkAtHome) {
  const ReferenceRobot& robot = reference_robot();
  KinematicTree kinematics(robot.model, robot.joint_names);
  kinematics.update(robot.q_home);
  const double gap = clearance(kinematics, right_arm_guards(robot.model), trunk_guards(robot.model));
  EXPECT_GT(gap, 0.05);
  EXPECT_LT(gap, 0.2);
}

}  // namespace
}  // namespace walkman::motion
