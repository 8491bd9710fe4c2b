#include "adaptation/regrasp/surroundings.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace walkman::regrasp {
namespace {

constexpr double kTableHeight = 0.9, kCameraHeight = 1.6;  // m
constexpr double kNear = 0.5, kFar = 1.1;                  // m, edges of the table in front of the camera
constexpr double kHalfWidth = 0.5;                         // m
constexpr double kDown = 0.7;                              // rad, the camera's pitch

/// A camera above a floor, looking down on a table; T is on the floor below it.
class SurroundingsTest : public testing::Test {
 protected:
  SurroundingsTest() {
    X_TC.translation().z() = kCameraHeight;
    Eigen::Matrix3d level;  // z forward, x right, y down
    level << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    X_TC.linear() = level * Eigen::AngleAxisd(-kDown, Eigen::Vector3d::UnitX()).toRotationMatrix();
    const Eigen::Isometry3d X_CT = X_TC.inverse();
    seen.plane.n_C = X_CT.linear().col(2);
    for (const double x : {kNear, kFar})
      for (const double y : {-kHalfWidth, 0.0, kHalfWidth})
        seen.plane.hull_C.push_back(X_CT * Eigen::Vector3d(x, y, kTableHeight));
    seen.plane.offset = -seen.plane.n_C.dot(seen.plane.hull_C.front());
    seen.objects.resize(1);
    cloud.width = cloud.height = 400;
  }

  /// Fills the cloud with the camera's view between two directions, given as distances to its right in the
  /// plane at 1 m.
  void look(double left, double right) {
    for (int row = 0; row < cloud.height; ++row) {
      for (int column = 0; column < cloud.width; ++column) {
        Eigen::Vector3d ray_C(left + (right - left) * column / cloud.width, -0.8 + 1.6 * row / cloud.height,
                              1);
        const Eigen::Vector3d ray_T = X_TC.linear() * ray_C;
        cloud.points.emplace_back().setConstant(std::numeric_limits<float>::quiet_NaN());
        for (const double height : {kTableHeight, 0.0}) {
          const double range = (height - kCameraHeight) / ray_T.z();
          const Eigen::Vector3d p_T = X_TC.translation() + range * ray_T;
          const bool on_table = p_T.x() > kNear && p_T.x() < kFar && std::abs(p_T.y()) < kHalfWidth;
          if (range < 0 || (height > 0 && !on_table)) continue;
          cloud.points.back() = (X_TC.inverse() * p_T).cast<float>();
          break;
        }
      }
    }
  }

  double distance(double x, double y) const {
    return surroundings(seen, table_outline(seen, cloud, X_TC), X_TC)
        .at(0)
        .prism.distance({x, y, kTableHeight - 0.05});
  }

  Eigen::Isometry3d X_TC = Eigen::Isometry3d::Identity();
  perception::StageOneResult seen;
  camera::OrganizedCloud cloud;
};

TEST_F(SurroundingsTest, ATableWithFloorAroundItEndsWhereItEnds) {
  look(-1.5, 1.5);
  for (const double side : {-1.0, 1.0}) {
    EXPECT_LT(distance(0.7, side * kHalfWidth), 0);
    EXPECT_GT(distance(0.7, side * (kHalfWidth + 0.02)), 0);
  }
  EXPECT_GT(distance(kNear - 0.02, 0), 0);
  EXPECT_GT(distance(kFar + 0.02, 0), 0);
}

TEST_F(SurroundingsTest, ATableGoesOnBeyondTheImagesSide) {
  look(-1.5, 0.5);
  // At y < 0 the table's near corner is beyond the image and the far one is not.
  EXPECT_LT(distance(0.55, -kHalfWidth - 0.3), 0);
  EXPECT_GT(distance(0.7, kHalfWidth + 0.02), 0);
  EXPECT_GT(distance(kNear - 0.03, -kHalfWidth), 0);
}

TEST_F(SurroundingsTest, ATableGoesOnBehindTheRobotsOwnHand) {
  look(-1.5, 1.5);
  for (Eigen::Vector3f& p : cloud.points)
    if (p.x() / p.z() < -0.4F) p.setConstant(std::numeric_limits<float>::quiet_NaN());
  EXPECT_LT(distance(0.7, kHalfWidth + 0.3), 0);
  EXPECT_GT(distance(0.7, -kHalfWidth - 0.02), 0);
}

// If the head looks to the right, the table's left side continues along the table's edge, not along the
// image's.
TEST_F(SurroundingsTest, ATurnedCameraKnowsWhereTheTablesEdgeRunsTo) {
  const Eigen::Isometry3d X_CT_before = X_TC.inverse();
  X_TC.linear() = Eigen::AngleAxisd(-0.4, Eigen::Vector3d::UnitZ()).toRotationMatrix() * X_TC.linear();
  const Eigen::Isometry3d X_CC = X_TC.inverse() * X_CT_before.inverse();
  seen.plane.n_C = X_CC.linear() * seen.plane.n_C;
  // In order around the table, as Stage I gives them.
  seen.plane.hull_C.clear();
  for (const auto& [x, y] :
       {std::pair{kNear, kHalfWidth}, {kNear, -kHalfWidth}, {kFar, -kHalfWidth}, {kFar, kHalfWidth}})
    seen.plane.hull_C.push_back(X_TC.inverse() * Eigen::Vector3d(x, y, kTableHeight));
  look(-0.2, 1.5);
  EXPECT_LT(distance(kNear + 0.03, kHalfWidth + 0.3), 0);
  EXPECT_GT(distance(kNear - 0.03, kHalfWidth + 0.3), 0);
}

TEST_F(SurroundingsTest, WhatLiesBesideTheObjectIsAColumnAsHighAsItsHighestPoint) {
  look(-1.5, 1.5);
  seen.objects.resize(2);
  const Eigen::Isometry3d X_CT = X_TC.inverse();
  for (const double x : {0.7, 0.8})
    for (const double y : {0.1, 0.2})
      seen.objects[1].surface_C.push_back(
          (X_CT * Eigen::Vector3d(x, y, kTableHeight + x - 0.7)).cast<float>());
  const auto all = surroundings(seen, table_outline(seen, cloud, X_TC), X_TC);
  ASSERT_EQ(all.size(), 2);
  EXPECT_EQ(all[1].name, "the object beside it (10 cm high)");
  EXPECT_NEAR(all[1].prism.distance({0.75, 0.15, kTableHeight + 0.15}), 0.05, 1e-5);
  EXPECT_NEAR(all[1].prism.distance({0.65, 0.15, kTableHeight}), 0.05, 1e-5);
}

TEST_F(SurroundingsTest, WhatStandsHighOnTheObjectIsInTheWayAndWhatIsLowIsNot) {
  look(-1.5, 1.5);
  const Eigen::Isometry3d X_CT = X_TC.inverse();
  perception::SeenObject& hammer = seen.objects.front();
  perception::Handle handle;
  handle.p_CM = X_CT * Eigen::Vector3d(0.7, 0, kTableHeight + 0.055);
  handle.axis_C = X_CT.linear() * -Eigen::Vector3d::UnitY();
  handle.radius = 0.025;
  handle.from = -0.3;
  handle.to = 0.3;
  hammer.handles = {handle};
  hammer.surface_C.clear();
  const auto put = [&](double y, double height) {
    for (const double x : {0.66, 0.74})
      for (const double beside : {-0.04, 0.04})
        hammer.surface_C.push_back(
            (X_CT * Eigen::Vector3d(x, y + beside, kTableHeight + height)).cast<float>());
  };
  put(0.35, 0.09);   // a clamp, 1 cm over the handle
  put(-0.35, 0.12);  // a head
  const auto parts = rest_of_object(seen, 0, 0, X_TC);
  ASSERT_EQ(parts.size(), 1);
  EXPECT_EQ(parts[0].name, "a part of the object (12 cm high)");
  EXPECT_NEAR(parts[0].prism.distance({0.7, -0.26, kTableHeight + 0.05}), 0.05, 1e-5);
  // Leaves out what lies within the hand's room around its grasp.
  EXPECT_TRUE(rest_of_object(seen, 0, 0.3, X_TC).empty());
}

}  // namespace
}  // namespace walkman::regrasp
