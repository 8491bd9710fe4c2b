// Pictures of scenes with silhouettes and shadows known from geometry.

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>
#include <png.h>

#include "apps/picture/picture_renderer.h"
#include "apps/picture/png_file.h"

namespace walkman::picture {
namespace {

const Paint kRed{{0.6F, 0, 0}, 0, false};
const Paint kWhite{{0.5F, 0.5F, 0.5F}, 0, false};
constexpr double kRadius = 0.3;  // m, of the sphere; its centre is kHeight above the plate
constexpr double kHeight = 0.5;

/// A red sphere above a grey plate whose upper surface is z = 0.
void fill(PaintedScene& scene) {
  Eigen::Isometry3d X_WS = Eigen::Isometry3d::Identity();
  X_WS.translation().z() = kHeight;
  Eigen::Isometry3d X_WP = Eigen::Isometry3d::Identity();
  X_WP.translation().z() = -0.05;
  scene.add({{Eigen::Isometry3d::Identity(), SphereShape{kRadius}, "sphere"}}, X_WS, kRed);
  scene.add({{Eigen::Isometry3d::Identity(), BoxShape{{4, 4, 0.1}}, "plate"}}, X_WP, kWhite);
}

std::vector<Eigen::Vector3d> corners(const Eigen::Vector3d& least, const Eigen::Vector3d& most) {
  const Eigen::AlignedBox3d box(least, most);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 8; ++i) points.push_back(box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i)));
  return points;
}

PictureCamera camera_beside() {
  return camera_around(corners({-0.6, -0.6, -0.1}, {0.6, 0.6, 1.1}), 0.7, 0.4, 0.5, 320, 240);
}

/// A sun vertically above, without a disc.
Lighting sun_above() {
  Lighting lighting;
  lighting.p_to_sun = {0, 0, 1};
  lighting.sun_spread = 0;
  return lighting;
}

std::array<std::uint8_t, 3> at(const Picture& picture, int column, int row) {
  return picture.pixels[static_cast<std::size_t>(row) * static_cast<std::size_t>(picture.width) +
                        static_cast<std::size_t>(column)];
}

bool is_red(const std::array<std::uint8_t, 3>& pixel) {
  return pixel[0] > 0 && pixel[1] == 0 && pixel[2] == 0;
}

/// Direction in W of the ray through a point of the picture, px from its upper left corner.
Eigen::Vector3d direction_W(const PictureCamera& camera, double x, double y) {
  return (camera.X_WC.linear() * Eigen::Vector3d((x - 0.5 * camera.width) / camera.focal_px,
                                                 (y - 0.5 * camera.height) / camera.focal_px, 1))
      .normalized();
}

std::string contents(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

TEST(Pictures, SphereHasItsAnalyticSilhouette) {
  PaintedScene scene;
  fill(scene);
  const PictureCamera camera = camera_beside();
  const Picture picture = render(scene, camera, sun_above(), 16, 2);
  const Eigen::Vector3d to_sphere = Eigen::Vector3d(0, 0, kHeight) - camera.X_WC.translation();
  const double half_angle = std::asin(kRadius / to_sphere.norm());
  int red = 0, mixed = 0;
  for (int row = 0; row < picture.height; ++row) {
    for (int column = 0; column < picture.width; ++column) {
      const Eigen::Vector3d direction = direction_W(camera, column + 0.5, row + 0.5);
      const double angle = std::acos(direction.dot(to_sphere.normalized()));
      const double inside = (half_angle - angle) * camera.focal_px;  // px, approximately
      const std::array<std::uint8_t, 3> pixel = at(picture, column, row);
      if (inside > 1.5) {
        ASSERT_TRUE(is_red(pixel)) << column << ", " << row;
        ++red;
      } else if (inside < -1.5) {
        ASSERT_GT(pixel[1], 0) << column << ", " << row;
      } else {
        mixed += pixel[1] > 0 && pixel[0] != pixel[1] ? 1 : 0;
      }
    }
  }
  EXPECT_GT(red, 2000);
  EXPECT_GT(mixed, 50);  // the edge is smooth
}

TEST(Pictures, ShadowOfTheSunLiesWhereItsRaysAreCutOff) {
  PaintedScene scene;
  fill(scene);
  const PictureCamera camera = camera_beside();
  const Picture picture = render(scene, camera, sun_above(), 16, 2);
  int dark = 0, bright = 0;
  for (int row = 0; row < picture.height; ++row) {
    for (int column = 0; column < picture.width; ++column) {
      const Eigen::Vector3d direction = direction_W(camera, column + 0.5, row + 0.5);
      if (direction.z() > -0.05) continue;
      const Eigen::Vector3d eye = camera.X_WC.translation();
      const Eigen::Vector3d p = eye - direction * (eye.z() / direction.z());
      const Eigen::Vector3d to_centre = Eigen::Vector3d(0, 0, kHeight) - eye;
      const bool behind_sphere = to_centre.cross(direction).norm() < 1.05 * kRadius;
      const double from_axis = p.head<2>().norm();
      if (behind_sphere || std::abs(from_axis - kRadius) < 0.03 || p.cwiseAbs().maxCoeff() > 1.9) continue;
      const std::uint8_t level = at(picture, column, row)[1];
      // Without the sun the plate has at most 0.5 (sky + camera), with it as much as 1.3·0.5 more.
      if (from_axis < kRadius) {
        ASSERT_LT(level, 180) << column << ", " << row;
        ++dark;
      } else {
        ASSERT_GT(level, 215) << column << ", " << row;
        ++bright;
      }
    }
  }
  EXPECT_GT(dark, 200);
  EXPECT_GT(bright, 5000);
}

TEST(Pictures, CameraSeesAllPointsAndIsNoFartherThanItMust) {
  const std::vector<Eigen::Vector3d> points = corners({-0.2, -0.9, 0}, {1.3, 0.8, 1.9});
  for (const double azimuth : {0.0, 0.7, -2.5, 3.1}) {
    for (const double elevation : {-0.3, 0.0, 0.6, 1.4}) {
      for (const auto& [width, height] : {std::pair(400, 300), std::pair(300, 500)}) {
        const PictureCamera camera = camera_around(points, azimuth, elevation, 0.5, width, height);
        Eigen::Array2d least(1, 1), most(-1, -1);  // relative to the picture's half width and height
        for (const Eigen::Vector3d& p_W : points) {
          const Eigen::Vector3d p = camera.X_WC.inverse() * p_W;
          ASSERT_GT(p.z(), 0);
          const Eigen::Array2d seen =
              p.head<2>().array() / p.z() * camera.focal_px * 2 / Eigen::Array2d(width, height);
          least = least.min(seen);
          most = most.max(seen);
        }
        EXPECT_LE(std::max(-least.minCoeff(), most.maxCoeff()), 0.9201);
        // In one of the two directions the picture is filled from margin to margin.
        const Eigen::Array2d filled = (-least).min(most);
        EXPECT_NEAR(filled.maxCoeff(), 0.92, 1e-9);
        const Eigen::Vector3d towards = camera.X_WC.linear().col(2);
        EXPECT_NEAR(towards.z(), -std::sin(elevation), 1e-12);
        EXPECT_NEAR(std::remainder(std::atan2(-towards.y(), -towards.x()) - azimuth, 2 * M_PI), 0, 1e-12);
        EXPECT_NEAR(camera.X_WC.linear().determinant(), 1, 1e-12);
        EXPECT_GT(-camera.X_WC.linear().col(1).z(), 0);  // up is up
        EXPECT_NEAR(camera.X_WC.linear().col(0).z(), 0, 1e-12);
      }
    }
  }
}

TEST(Pictures, SameBytesWhateverTheNumberOfThreads) {
  PaintedScene scene;
  fill(scene);
  Lighting lighting;
  lighting.sun_spread = 0.1F;
  const std::string folder = ::testing::TempDir();
  write_png(render(scene, camera_beside(), lighting, 9, 1), folder + "walkman_picture_1.png");
  write_png(render(scene, camera_beside(), lighting, 9, 3), folder + "walkman_picture_3.png");
  const std::string bytes = contents(folder + "walkman_picture_1.png");
  EXPECT_GT(bytes.size(), 1000U);
  EXPECT_EQ(bytes, contents(folder + "walkman_picture_3.png"));
}

TEST(Pictures, PngHoldsEveryPixel) {
  Picture picture{3, 2, {{1, 2, 3}, {255, 0, 128}, {0, 0, 0}, {9, 8, 7}, {200, 201, 202}, {17, 0, 255}}};
  const std::string file = ::testing::TempDir() + "walkman_six_pixels.png";
  write_png(picture, file);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_file(&image, file.c_str()), 0) << image.message;
  EXPECT_EQ(image.width, 3U);
  EXPECT_EQ(image.height, 2U);
  image.format = PNG_FORMAT_RGB;
  std::vector<std::array<std::uint8_t, 3>> read(6);
  ASSERT_NE(png_image_finish_read(&image, nullptr, read.data(), 0, nullptr), 0) << image.message;
  EXPECT_EQ(read, picture.pixels);
}

TEST(Pictures, RefuseWhatCannotBeDone) {
  PaintedScene scene;
  fill(scene);
  PictureCamera camera = camera_beside();
  EXPECT_THROW((void)render(scene, camera, {}, 0, 1), std::invalid_argument);
  EXPECT_THROW((void)render(scene, camera, {}, 1, 0), std::invalid_argument);
  camera.width = 0;
  EXPECT_THROW((void)render(scene, camera, {}, 1, 1), std::invalid_argument);
  const std::vector<Eigen::Vector3d> box = corners({0, 0, 0}, {1, 1, 1});
  EXPECT_THROW((void)camera_around({}, 0, 0, 0.5, 10, 10), std::invalid_argument);
  EXPECT_THROW((void)camera_around(box, 0, 1.57, 0.5, 10, 10), std::invalid_argument);
  EXPECT_THROW((void)camera_around(box, std::nan(""), 0, 0.5, 10, 10), std::invalid_argument);
  EXPECT_THROW((void)camera_around(box, 0, 0, 0, 10, 10), std::invalid_argument);
  EXPECT_THROW((void)camera_around(box, 0, 0, 0.5, 0, 10), std::invalid_argument);
  EXPECT_THROW(write_png(Picture{2, 2, {}}, ::testing::TempDir() + "walkman_none.png"),
               std::invalid_argument);
  try {
    write_png(Picture{1, 1, {{1, 2, 3}}}, "/no/such/folder/picture.png");
    FAIL() << "an impossible file was written";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("/no/such/folder/picture.png: cannot be written"), std::string::npos)
        << e.what();
  }
}

}  // namespace
}  // namespace walkman::picture
