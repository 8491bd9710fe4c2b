#include <cmath>
#include <functional>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "sensors/stereo_camera.h"
#include "sensors/triangulation.h"
#include "tests/rigs/stereo_points.h"
#include "tests/unit/sensors/analytic_shapes.h"

namespace walkman::sensors {
namespace {

using Points = std::vector<Eigen::Vector3f>;
/// Depth of the nearest surface along p_C = t·(x, y, 1), in double precision.
using Depth = std::function<double(const Eigen::Vector3d& ray_C)>;

const Eigen::Isometry3d kX_WC = pose(0.4, -1.2, 1.6, -2.0, 0.1, 0.7);

Eigen::Vector3d ray(const StereoOptions& o, int u, int v) {
  return {(u - o.cx) / o.focal_px, (v - o.cy) / o.focal_px, 1};
}

struct Comparison {
  std::size_t compared = 0;
  std::size_t missing = 0;         ///< surface in both views by its equation, no point in the cloud
  double worst = 0;                ///< relative error of the depth
  double worst_lateral = 0;        ///< distance of the point from its pixel's ray divided by its depth
  std::size_t off_silhouette = 0;  ///< pixels that hit in one and miss in the other
};

/// `clear`: whether the pixel is far enough from a silhouette to be compared.
Comparison compare(const LinkGeometry& geometry, const Eigen::Isometry3d& X_CL, const Depth& depth) {
  const StereoOptions options = StereoOptions().noise_free();
  RayScene scene;
  scene.add_fixed({geometry}, kX_WC * X_CL);
  StereoCamera camera(options);
  const Points points = captured_points(camera, scene, kX_WC, 1, 0);
  Comparison result;
  for (int v = 0; v < options.height; ++v) {
    for (int u = 0; u < options.width; ++u) {
      const Eigen::Vector3d r = ray(options, u, v);
      const double z = depth(r);
      const Eigen::Vector3f& p = point_at(points, options.width, u, v);
      const double d = options.focal_px * options.baseline / z;
      if (!std::isfinite(z)) {
        result.off_silhouette += std::isnan(p.z()) ? 0 : 1;
        continue;
      }
      if (u - d < 0 || d >= options.max_disparity) continue;
      if (std::isnan(p.z())) {
        ++result.missing;
        continue;
      }
      ++result.compared;
      result.worst = std::max(result.worst, std::abs(static_cast<double>(p.z()) - z) / z);
      result.worst_lateral =
          std::max(result.worst_lateral, (p.cast<double>() - r * static_cast<double>(p.z())).norm() / z);
    }
  }
  return result;
}

TEST(StereoGeometry, PlaneAtEveryPixel) {
  // One face of a large thin box, seen at about 30 degrees.
  const Eigen::Isometry3d X_CL = pose(0.1, -0.2, 1.5, 0.4, -0.3, 0.3);
  const Eigen::Vector3d size(20, 20, 0.02);
  const Eigen::Vector3d normal = X_CL.linear().col(2);
  const double distance = normal.dot(X_CL.translation()) - 0.01;
  const Comparison c =
      compare(box(size), X_CL, [&](const Eigen::Vector3d& r) { return distance / normal.dot(r); });
  EXPECT_GT(c.compared, 950'000U);
  EXPECT_EQ(c.missing, 0U);
  EXPECT_LT(c.worst, 1e-5);
  EXPECT_LT(c.worst_lateral, 1e-6);
}

TEST(StereoGeometry, BoxAtEveryPixel) {
  const Eigen::Isometry3d X_CL = pose(0.1, 0.05, 0.9, 0.5, 0.7, 0.2);
  const Eigen::Vector3d size(0.3, 0.2, 0.4);
  const Comparison c = compare(box(size), X_CL, [&](const Eigen::Vector3d& r) {
    const Eigen::Isometry3d X_LC = X_CL.inverse();
    return cast_box(size, X_LC.translation(), X_LC.linear() * r, 0);
  });
  EXPECT_GT(c.compared, 40'000U);
  EXPECT_LT(c.worst, 1e-5);
  EXPECT_LE(c.off_silhouette, 2U);
}

TEST(StereoGeometry, SphereWithinTheChordTolerance) {
  // Depth errors grow towards the rim as 1/cos of the incidence angle; 84 degrees is the limit of the
  // comparison.
  const double radius = 0.1;
  const Eigen::Isometry3d X_CL = pose(-0.05, 0.08, 0.8);
  const Comparison c = compare({Eigen::Isometry3d::Identity(), SphereShape{radius}, "sphere"}, X_CL,
                               [&](const Eigen::Vector3d& r) {
                                 const double t = cast_sphere(0.995 * radius, -X_CL.translation(), r, 0);
                                 if (!std::isfinite(t)) return t;
                                 return cast_sphere(radius, -X_CL.translation(), r, 0);
                               });
  EXPECT_GT(c.compared, 15'000U);
  EXPECT_EQ(c.missing, 0U);
  EXPECT_LT(c.worst * 0.8, 10 * kChordTolerance);
}

TEST(StereoGeometry, CylinderWithinTheChordTolerance) {
  const Eigen::Isometry3d X_CL = pose(0.05, 0.1, 1.0, 1.4, 0.2, 0.4);
  const Eigen::Isometry3d X_LC = X_CL.inverse();
  double worst = 0;
  double sum = 0;
  std::size_t count = 0;
  const StereoOptions options = StereoOptions().noise_free();
  RayScene scene;
  scene.add_fixed({{Eigen::Isometry3d::Identity(), CylinderShape{0.035, 1.05}, "bar"}}, kX_WC * X_CL);
  StereoCamera camera(options);
  const Points points = captured_points(camera, scene, kX_WC, 1, 0);
  for (int v = 0; v < options.height; ++v) {
    for (int u = 64; u < options.width; ++u) {
      const double z = cast_cylinder(0.035, 1.05, X_LC.translation(), X_LC.linear() * ray(options, u, v), 0);
      const Eigen::Vector3f& p = point_at(points, options.width, u, v);
      if (!std::isfinite(z) || std::isnan(p.z())) continue;
      // Distance from the curved surface, from whichever direction the pixel sees it.
      const Eigen::Vector3d p_L = X_LC * p.cast<double>();
      if (std::abs(p_L.z()) > 0.52) continue;
      const double error = p_L.head<2>().norm() - 0.035;
      worst = std::max(worst, std::abs(error));
      sum += error;
      ++count;
    }
  }
  EXPECT_GT(count, 15'000U);
  EXPECT_LT(worst, 1.1 * kChordTolerance);
  EXPECT_LT(std::abs(sum / static_cast<double>(count)), 0.5 * kChordTolerance);
}

TEST(StereoGeometry, BlankBandWhereTheRightCameraDoesNotLook) {
  const StereoOptions options = StereoOptions().noise_free();
  RayScene scene;
  scene.add_fixed({box({8, 8, 0.02}, pose(0, 0, 1.01))}, kX_WC);
  StereoCamera camera(options);
  const Points points = captured_points(camera, scene, kX_WC, 1, 0);
  const double d = options.focal_px * options.baseline / 1.0;  // 41.216 px
  for (int v = 0; v < options.height; v += 31) {
    for (int u = 0; u < options.width; ++u) {
      ASSERT_EQ(std::isnan(point_at(points, options.width, u, v).z()), u < d) << u << " " << v;
    }
  }
}

TEST(StereoGeometry, SearchRangeAndHousingLimitTheDepth) {
  StereoOptions options = StereoOptions().noise_free();
  const auto centre_depth = [&](double z) {
    RayScene scene;
    scene.add_fixed({box({8, 8, 0.02}, pose(0, 0, z + 0.01))}, Eigen::Isometry3d::Identity());
    scene.add_fixed({box({8, 8, 0.02}, pose(0, 0, 3.01))}, Eigen::Isometry3d::Identity());
    StereoCamera camera(options);
    const Points points = captured_points(camera, scene, Eigen::Isometry3d::Identity(), 1, 0);
    return points[512 * 1024 + 900].z();
  };
  const double nearest = options.focal_px * options.baseline / options.max_disparity;  // 0.322 m
  EXPECT_NEAR(centre_depth(nearest + 0.001), nearest + 0.001, 1e-5);
  EXPECT_TRUE(std::isnan(centre_depth(nearest - 0.001)));
  // Closer than the housing's glass: both cameras look past it.
  options.min_depth = 0.1;
  EXPECT_NEAR(centre_depth(0.05), 3.0, 1e-4);
}

TEST(StereoGeometry, RefusesOptionsOutOfRange) {
  const auto refused = [](const std::function<void(StereoOptions&)>& change) {
    StereoOptions options;
    change(options);
    EXPECT_THROW(StereoCamera{options}, std::invalid_argument);
  };
  refused([](StereoOptions& o) { o.width = 0; });
  refused([](StereoOptions& o) { o.height = -3; });
  refused([](StereoOptions& o) { o.focal_px = std::nan(""); });
  refused([](StereoOptions& o) { o.baseline = 0; });
  refused([](StereoOptions& o) { o.min_depth = 0; });
  refused([](StereoOptions& o) { o.max_disparity = 0; });
  refused([](StereoOptions& o) { o.sigma_d = -0.1; });
  refused([](StereoOptions& o) { o.fattening_px = -1; });
  refused([](StereoOptions& o) { o.spike_fraction = 0.21; });
  refused([](StereoOptions& o) { o.dropout_fraction = std::nan(""); });
  refused([](StereoOptions& o) { o.disparity_step = -1; });
  refused([](StereoOptions& o) { o.threads = 0; });
}

}  // namespace
}  // namespace walkman::sensors
