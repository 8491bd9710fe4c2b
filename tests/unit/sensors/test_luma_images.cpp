// Images of the camera pair compared with the pair's own geometry, the imager's data sheet, and each other.

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "sensors/luma_images.h"
#include "tests/rigs/stereo_points.h"
#include "tests/unit/sensors/analytic_shapes.h"

namespace walkman::sensors {
namespace {

constexpr double kFullWell = 13500, kDarkNoise = 13;  // electrons, CMV2000 and CMV4000

StereoOptions small_camera() {
  StereoOptions options = StereoOptions().noise_free();
  options.width = 512;
  options.height = 384;
  options.focal_px = 300;
  options.cx = 255.5;
  options.cy = 191.5;
  return options;
}

/// A room with a box and a rod in it: there is a surface behind every pixel of both images.
struct Room {
  RayScene scene;
  Eigen::Isometry3d X_WB = pose(0.1, 0, 1.0, 0.2, 0.5, 0.1);

  Room() {
    scene.add_fixed({box({8, 8, 6})}, Eigen::Isometry3d::Identity());
    EXPECT_EQ(scene.add_movable({box({0.3, 0.3, 0.3})}), 0);
    scene.update(std::vector{X_WB});
  }
};

struct Shot {
  std::vector<float> disparity;
  StereoImages images;
};

Shot shoot(const StereoOptions& options, Room& room, const Eigen::Isometry3d& X_WC, std::uint64_t frame = 0) {
  StereoCamera camera(options);
  Shot shot;
  camera.capture(room.scene, X_WC, 1, frame, shot.disparity, &shot.images);
  return shot;
}

/// Interpolates linearly between columns.
double at(const std::vector<std::uint8_t>& image, int width, double u, int v) {
  const int left = static_cast<int>(u);
  const std::size_t i =
      static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(left);
  return image[i] + (u - left) * (image[i + 1] - image[i]);
}

TEST(LumaImages, ShowTheSamePointsTheirDisparityApart) {
  const StereoOptions options = small_camera();
  Room room;
  const Shot shot = shoot(options, room, pose(0, 0, -0.2, 0, 0, 0));
  // Mean difference of left pixels from the right ones `off` px away from the position given by their
  // disparity.
  const auto difference = [&](double off) {
    double sum = 0;
    int count = 0;
    for (int v = 0; v < options.height; ++v) {
      for (int u = 8; u + 8 < options.width; ++u) {
        const auto i = static_cast<std::size_t>(v) * static_cast<std::size_t>(options.width) +
                       static_cast<std::size_t>(u);
        const double right = u - static_cast<double>(shot.disparity[i]) + off;
        if (!(shot.disparity[i] > 0) || right < 0 || right > options.width - 2) continue;
        sum += std::abs(shot.images.left[i] - at(shot.images.right, options.width, right, v));
        ++count;
      }
    }
    EXPECT_GT(count, 150'000);
    return sum / count;
  };
  // Noise of two images, about 1.5 steps.
  EXPECT_LT(difference(0), 2.5);
  EXPECT_GT(difference(-3), 1.5 * difference(0));
  EXPECT_GT(difference(3), 1.5 * difference(0));
}

TEST(LumaImages, OfARoomHaveNoHoles) {
  const StereoOptions options = small_camera();
  Room room;
  const Shot shot = shoot(options, room, pose(0, 0, -0.2, 0, 0, 0));
  for (const auto* image : {&shot.images.left, &shot.images.right})
    EXPECT_EQ(std::count_if(image->begin(), image->end(), [](std::uint8_t value) { return value < 5; }), 0);
}

TEST(LumaImages, MoveWithTheirBodies) {
  const StereoOptions options = small_camera();
  Room room;
  const Eigen::Isometry3d X_WC = pose(0, 0, -0.2, 0, 0, 0);
  const Shot before = shoot(options, room, X_WC);
  // Camera and body move together: the body's pixels look as before, except for light and noise.
  const Eigen::Isometry3d X_WM = pose(0.2, 0.1, 0.05, 0, 0, 0);
  room.scene.update(std::vector{X_WM * room.X_WB});
  const Shot after = shoot(options, room, X_WM * X_WC);
  double moved = 0, stayed = 0;
  int on_body = 0, on_room = 0;
  for (std::size_t i = 0; i < before.disparity.size(); ++i) {
    const double difference = std::abs(before.images.left[i] - after.images.left[i]);
    const double z = options.focal_px * options.baseline / static_cast<double>(before.disparity[i]);
    if (z < 1.6) {
      moved += difference;
      ++on_body;
    } else if (std::isfinite(z)) {
      stayed += difference;
      ++on_room;
    }
  }
  ASSERT_GT(on_body, 2000);
  ASSERT_GT(on_room, 100'000);
  EXPECT_LT(moved / on_body, 3);
  EXPECT_GT(stayed / on_room, 1.5 * moved / on_body);
}

// The variance of the difference of two frames is twice that of one: photons, one electron each, and the dark
// noise.
TEST(LumaImages, HaveTheImagersNoise) {
  const StereoOptions options = small_camera();
  Room room;
  const Eigen::Isometry3d X_WC = pose(0, 0, -0.2, 0, 0, 0);
  const Shot one = shoot(options, room, X_WC, 1), two = shoot(options, room, X_WC, 2);
  for (const auto images : {&StereoImages::left, &StereoImages::right}) {
    double squares = 0, expected = 0;
    const std::vector<std::uint8_t>&a = one.images.*images, &b = two.images.*images;
    for (std::size_t i = 0; i < a.size(); ++i) {
      squares += std::pow(a[i] - b[i], 2);
      const double electrons = 0.5 * (a[i] + b[i]) / 255 * kFullWell;
      const double rounding = 1.0 / 12;
      expected += 2 * (std::pow(255 / kFullWell, 2) * (electrons + kDarkNoise * kDarkNoise) + rounding);
    }
    EXPECT_NEAR(squares / expected, 1, 0.05);
  }
}

TEST(LumaImages, LeaveTheDisparityAsItIs) {
  StereoOptions options = StereoOptions();
  options.width = options.height = 256;
  Room room;
  const Eigen::Isometry3d X_WC = pose(0, 0, -0.2, 0, 0, 0);
  StereoCamera camera(options);
  std::vector<float> alone;
  camera.capture(room.scene, X_WC, 1, 7, alone);
  EXPECT_EQ(shoot(options, room, X_WC, 7).disparity, alone);
}

float albedo(const SurfacePattern& pattern, float x, float z) {
  const float y = 0.3F, footprint = 0.001F;
  float share = 0;
  pattern.albedos(1, {{&x, 1}, {&y, 1}, {&z, 1}, {&footprint, 1}}, {&share, 1});
  return share;
}

TEST(SurfacePattern, IsTheSameForASeedAndHasPatchesWithoutTexture) {
  const SurfacePattern pattern(1, 3), again(1, 3), other(2, 3);
  int differ = 0;
  std::vector<double> contrast;
  for (int patch = 0; patch < 400; ++patch) {
    double sum = 0, squares = 0;
    constexpr int kSide = 8;
    for (int i = 0; i < kSide * kSide; ++i) {
      const float x = 0.02F * static_cast<float>(patch) + 0.001F * static_cast<float>(i % kSide);
      const int row = i / kSide;
      const float z = 0.001F * static_cast<float>(row);
      const float value = albedo(pattern, x, z);
      EXPECT_EQ(value, albedo(again, x, z));
      EXPECT_GE(value, 0.02F);
      EXPECT_LE(value, 0.98F);
      differ += value == albedo(other, x, z) ? 0 : 1;
      sum += static_cast<double>(value);
      squares += std::pow(static_cast<double>(value), 2);
    }
    const double mean = sum / (kSide * kSide);
    contrast.push_back(std::sqrt(std::max(0.0, squares / (kSide * kSide) - mean * mean)) / mean);
  }
  EXPECT_GT(differ, 20'000);
  std::sort(contrast.begin(), contrast.end());
  EXPECT_LT(contrast[20], 0.5 * contrast[200]);
}

/// Along a flat side of a body, no piece of the pattern occurs a second time within 3 m.
TEST(SurfacePattern, DoesNotRepeat) {
  const SurfacePattern pattern(1, 2);
  constexpr std::size_t kSide = 48;
  constexpr float kStep = 0.0025F;
  const auto piece = [&](float x0, float y0) {
    std::vector<float> x, y, z, out(kSide * kSide);
    for (std::size_t i = 0; i < kSide * kSide; ++i) {
      const std::size_t column = i % kSide, row = i / kSide;
      const Eigen::Vector3f p_B(x0 + kStep * static_cast<float>(column), y0 + kStep * static_cast<float>(row),
                                0.1F);
      const Eigen::Vector3f p_P = pattern.X_PB(1).cast<float>() * p_B;
      x.push_back(p_P.x());
      y.push_back(p_P.y());
      z.push_back(p_P.z());
    }
    pattern.albedos(1, {x, y, z, std::vector<float>(out.size(), 0.001F)}, out);
    const Eigen::Map<Eigen::ArrayXf> values(out.data(), static_cast<Eigen::Index>(out.size()));
    return Eigen::ArrayXf((values - values.mean()) / std::sqrt((values - values.mean()).square().sum()));
  };
  const Eigen::ArrayXf here = piece(0, 0);
  float most = 0;
  for (int step = 20; step < 1200; ++step) {
    const float shift = kStep * static_cast<float>(step);
    most = std::max({most, (here * piece(shift, 0)).sum(), (here * piece(0, shift)).sum()});
  }
  EXPECT_LT(most, 0.5F);
  EXPECT_GT((here * piece(1e-4F, 0)).sum(), 0.9F);
}

}  // namespace
}  // namespace walkman::sensors
