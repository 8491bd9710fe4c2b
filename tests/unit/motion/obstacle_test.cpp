#include "adaptation/motion/obstacle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
  points.reserve(kTable.size());
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
  EXPECT_THAT(message_for(up, {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}), testing::HasSubstr("collinear points"));
  EXPECT_THAT(message_for(Eigen::Vector3d::Zero(), kTable), testing::HasSubstr("without a direction"));
  EXPECT_THAT(message_for(up, {{0, 0, 0}, {1, 0, 0}, {2, std::nan(""), 0}}),
              testing::HasSubstr("not finite"));
}

}  // namespace
}  // namespace walkman::motion
