#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "sensors/stereo_camera.h"
#include "tests/rigs/stereo_points.h"
#include "tests/unit/sensors/analytic_shapes.h"

namespace walkman::sensors {
namespace {

using Points = std::vector<Eigen::Vector3f>;

/// A wall at 1.2 m, alone or with a box 0.6 m in front of the camera.
struct Wall {
  RayScene scene;
  explicit Wall(bool with_box = false) {
    scene.add_fixed({box({8, 8, 0.02}, pose(0, 0, 1.21))}, Eigen::Isometry3d::Identity());
    if (with_box) scene.add_fixed({box({0.2, 0.2, 0.1}, pose(0, 0, 0.65))}, Eigen::Isometry3d::Identity());
  }
  [[nodiscard]] Points capture(const StereoOptions& options, std::uint64_t seed, std::uint64_t frame) const {
    StereoCamera camera(options);
    return captured_points(camera, scene, Eigen::Isometry3d::Identity(), seed, frame);
  }
};

double disparity(const StereoOptions& o, double z) { return o.focal_px * o.baseline / z; }

bool same_bytes(const Points& a, const Points& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0;
}

TEST(MatcherNoise, HasTheStatedDeviationAndCorrelation) {
  StereoOptions options = StereoOptions().noise_free();
  options.sigma_d = 0.2;
  const Points points = Wall().capture(options, 1, 0);
  const double true_disparity = disparity(options, 1.2);
  constexpr int kFirst = 64;  // right of the blank band
  const auto error = [&](int u, int v) {
    return disparity(options, point_at(points, options.width, u, v).z()) - true_disparity;
  };
  double sum = 0, square = 0, n = 0;
  std::vector<double> along(4), down(4);
  for (int v = 0; v + 3 < options.height; ++v) {
    for (int u = kFirst; u + 3 < options.width; ++u) {
      const double e = error(u, v);
      sum += e;
      square += e * e;
      n += 1;
      for (int k = 1; k < 4; ++k) {
        along[static_cast<std::size_t>(k)] += e * error(u + k, v);
        down[static_cast<std::size_t>(k)] += e * error(u, v + k);
      }
    }
  }
  EXPECT_NEAR(sum / n, 0, 0.006);
  EXPECT_NEAR(std::sqrt(square / n), 0.2, 0.03 * 0.2);
  for (int k = 1; k < 4; ++k) {
    const double expected = 0.64 * std::exp(-k * k / (4 * options.correlation_px * options.correlation_px));
    EXPECT_NEAR(along[static_cast<std::size_t>(k)] / square, expected, 0.03) << k;
    EXPECT_NEAR(down[static_cast<std::size_t>(k)] / square, expected, 0.03) << k;
  }
}

/// Depth error at six distances for a wall that is slightly inclined, so that every fraction of a pixel
/// occurs. z = f b / d, so that a deviation of d is one of z by z² / (f b).
TEST(MatcherNoise, OfDepthGrowsWithItsSquare) {
  StereoOptions options;
  options.spike_fraction = options.dropout_fraction = 0;
  std::vector<double> logs_of_z, logs_of_deviation;
  for (const double z : {0.7, 1.0, 1.4, 2.0, 2.8, 4.0}) {
    // One pixel of disparity from the left border of the image to the right one.
    const double d = disparity(options, z);
    const double lean =
        std::atan2(z * z / (options.focal_px * options.baseline), z * options.width / options.focal_px);
    RayScene scene;
    const Eigen::Isometry3d X_WB =
        pose(0, 0, z) * Eigen::AngleAxisd(lean, Eigen::Vector3d::UnitY()) * Eigen::Translation3d(0, 0, 0.01);
    scene.add_fixed({box({20, 20, 0.02}, X_WB)}, Eigen::Isometry3d::Identity());
    StereoCamera noisy(options), ideal(options.noise_free());
    const Points points = captured_points(noisy, scene, Eigen::Isometry3d::Identity(), 1, 0);
    const Points truth = captured_points(ideal, scene, Eigen::Isometry3d::Identity(), 1, 0);
    double square = 0, n = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (std::isnan(points[i].z()) || std::isnan(truth[i].z())) continue;
      square += std::pow(static_cast<double>(points[i].z()) - static_cast<double>(truth[i].z()), 2);
      ++n;
    }
    ASSERT_GT(n, 850'000);
    const double deviation = std::sqrt(square / n);
    // The lattice adds a twelfth of its squared step, the locking half of its squared amplitude.
    const double sigma = std::sqrt(0.04 + 1.0 / 256 / 12 + 0.05 * 0.05 / 2);
    EXPECT_NEAR(deviation, sigma * z / d, 0.05 * sigma * z / d) << z;
    logs_of_z.push_back(std::log(z));
    logs_of_deviation.push_back(std::log(deviation));
  }
  double x = 0, y = 0, xx = 0, xy = 0;
  const auto count = static_cast<double>(logs_of_z.size());
  for (std::size_t i = 0; i < logs_of_z.size(); ++i) {
    x += logs_of_z[i] / count;
    y += logs_of_deviation[i] / count;
  }
  for (std::size_t i = 0; i < logs_of_z.size(); ++i) {
    xx += std::pow(logs_of_z[i] - x, 2);
    xy += (logs_of_z[i] - x) * (logs_of_deviation[i] - y);
  }
  EXPECT_NEAR(xy / xx, 2, 0.05);
}

/// Matches cluster at whole disparities: the measured value is off by a sine of the true one.
TEST(MatcherNoise, LocksToWholeDisparities) {
  StereoOptions options = StereoOptions().noise_free();
  options.locking = 0.05;
  RayScene scene;  // a floor: a different disparity in every row
  scene.add_fixed({box({20, 0.02, 20}, pose(0, 0.71, 5))}, Eigen::Isometry3d::Identity());
  StereoCamera camera(options);
  const Points points = captured_points(camera, scene, Eigen::Isometry3d::Identity(), 1, 0);
  double least = 0, most = 0;
  for (int v = 600; v < 1000; ++v) {
    const double truth = options.baseline / 0.7 * (v - options.cy);
    const double found = disparity(options, point_at(points, 1024, 512, v).z());
    EXPECT_NEAR(found - truth, -0.05 * std::sin(2 * std::numbers::pi * truth), 3e-4) << v;
    least = std::min(least, found - truth);
    most = std::max(most, found - truth);
  }
  EXPECT_NEAR(least, -0.05, 0.001);
  EXPECT_NEAR(most, 0.05, 0.001);
}

TEST(MatcherNoise, DisparitiesLieOnTheLattice) {
  const StereoOptions options;
  const Points points = Wall(true).capture(options, 1, 0);
  std::size_t seen = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f& p = points[i];
    if (std::isnan(p.z())) {
      ASSERT_TRUE(std::isnan(p.x()) && std::isnan(p.y()));
      continue;
    }
    ++seen;
    const double steps = 16 * disparity(options, p.z());
    ASSERT_NEAR(steps, std::round(steps), 2e-6 * steps);
    const double d = steps / 16;
    const auto u = static_cast<double>(i % 1024);
    const auto row = i / 1024;
    const auto v = static_cast<double>(row);
    ASSERT_TRUE(d > 0 && d < options.max_disparity && d <= u + 1e-4);
    ASSERT_NEAR(p.x(), (u - options.cx) * options.baseline / d, 1e-6);
    ASSERT_NEAR(p.y(), (v - options.cy) * options.baseline / d, 1e-6);
  }
  EXPECT_GT(seen, 900'000U);
}

/// A camera of a tenth of the pixels, for statistics over many walls.
StereoOptions small_camera() {
  StereoOptions options = StereoOptions().noise_free();
  options.width = options.height = 320;
  options.cx = options.cy = 159.5;
  return options;
}

TEST(MatcherNoise, MismatchesAndDropoutsTakeTheirFractions) {
  // On average over walls of all contrasts: a single one has 0.7 to 8 % of dropouts.
  const Wall wall;
  StereoOptions mismatches = small_camera();
  mismatches.spike_fraction = 0.01;
  StereoOptions dropouts = small_camera();
  dropouts.dropout_fraction = 0.03;
  StereoCamera first(mismatches), second(dropouts);
  const double true_disparity = disparity(mismatches, 1.2);
  std::size_t wrong = 0, far = 0, lost = 0, moved = 0, n = 0;
  constexpr std::uint64_t kWalls = 600;
  for (std::uint64_t seed = 0; seed < kWalls; ++seed) {
    const Points a = captured_points(first, wall.scene, Eigen::Isometry3d::Identity(), seed, 0);
    const Points b = captured_points(second, wall.scene, Eigen::Isometry3d::Identity(), seed, 0);
    for (std::size_t i = 0; i < a.size(); ++i) {
      if (i % 320 < 64) continue;
      ++n;
      const double error = std::abs(disparity(mismatches, a[i].z()) - true_disparity);
      wrong += error > 0.5 ? 1 : 0;
      far += error > 9 * 1.3 || std::isnan(error) ? 1 : 0;
      lost += std::isnan(b[i].z()) ? 1 : 0;
      moved += std::abs(disparity(dropouts, b[i].z()) - true_disparity) > 1e-3 ? 1 : 0;
    }
  }
  EXPECT_NEAR(static_cast<double>(wrong) / static_cast<double>(n), 0.01, 0.0008);
  EXPECT_EQ(far, 0U);
  EXPECT_NEAR(static_cast<double>(lost) / static_cast<double>(n), 0.03, 0.003);
  EXPECT_EQ(moved, 0U);
}

/// Correlation of two frames' disparity errors at pixels that both have, and how many only one of them has;
/// pixel (u, v) of the first is (u + shift, v) of the second.
struct Agreement {
  double correlation = 0;
  std::size_t common = 0, one_only = 0;
};

Agreement agreement(const StereoOptions& options, const Points& a, const Points& b, double depth,
                    int shift = 0) {
  Agreement out;
  double ab = 0, aa = 0, bb = 0;
  for (int v = 0; v < options.height; ++v) {
    for (int u = 128; u + shift < options.width; ++u) {
      const double at_a =
          disparity(options, point_at(a, options.width, u, v).z()) - disparity(options, depth);
      const double at_b =
          disparity(options, point_at(b, options.width, u + shift, v).z()) - disparity(options, depth);
      if (std::isnan(at_a) || std::isnan(at_b)) {
        out.one_only += std::isnan(at_a) && std::isnan(at_b) ? 0 : 1;
        continue;
      }
      ++out.common;
      ab += at_a * at_b;
      aa += at_a * at_a;
      bb += at_b * at_b;
    }
  }
  out.correlation = ab / std::sqrt(aa * bb);
  return out;
}

TEST(MatcherNoise, StaysOnAStillScene) {
  // The part of weight 0.8 belongs to the surface, so two frames have a correlation of 0.64, and share the
  // pixels without a match.
  StereoOptions options = StereoOptions().noise_free();
  options.sigma_d = 0.2;
  options.dropout_fraction = 0.03;
  const Wall wall;
  const Points first = wall.capture(options, 1, 0);
  const Agreement still = agreement(options, first, wall.capture(options, 1, 7), 1.2);
  EXPECT_NEAR(still.correlation, 0.64, 0.01);
  EXPECT_EQ(still.one_only, 0U);
  EXPECT_GT(still.common, 850'000U);
  EXPECT_NEAR(agreement(options, first, wall.capture(options, 2, 0), 1.2).correlation, 0, 0.01);
}

/// Mismatches of two frames of a wall; pixel (u, v) of the first is (u + shift, v) of the second.
struct Mismatches {
  std::size_t first = 0, second = 0, both = 0;
};

Mismatches mismatches_of(const StereoOptions& options, const Points& a, const Points& b, int shift) {
  Mismatches out;
  const auto is_wrong = [&](const Points& points, int u, int v) {
    const double d = disparity(options, point_at(points, options.width, u, v).z());
    return std::abs(d - disparity(options, 1.2)) > 0.5;
  };
  for (int v = 0; v < options.height; ++v) {
    for (int u = 128; u + shift < options.width; ++u) {
      const bool first = is_wrong(a, u, v), second = is_wrong(b, u + shift, v);
      out.first += first ? 1 : 0;
      out.second += second ? 1 : 0;
      out.both += first && second ? 1 : 0;
    }
  }
  return out;
}

TEST(MatcherNoise, MismatchesBelongToPatchesOfTheSurface) {
  // A patch is matched wrongly in 0.64 of all frames, by whatever pixels it is shown.
  StereoOptions options = StereoOptions().noise_free();
  options.spike_fraction = 0.02;
  const Wall wall;
  const Points first = wall.capture(options, 1, 0);
  const Mismatches still = mismatches_of(options, first, wall.capture(options, 1, 7), 0);
  StereoCamera camera(options);
  const Eigen::Isometry3d X_WC(Eigen::Translation3d(-10 * 1.2 / options.focal_px, 0, 0));
  const Mismatches moved = mismatches_of(options, first, captured_points(camera, wall.scene, X_WC, 1, 7), 10);
  for (const Mismatches& frames : {still, moved}) {
    ASSERT_GT(frames.first, 8'000U);
    EXPECT_NEAR(static_cast<double>(frames.both) / static_cast<double>(frames.first), 0.64, 0.05);
    EXPECT_NEAR(static_cast<double>(frames.both) / static_cast<double>(frames.second), 0.64, 0.05);
  }
}

TEST(MatcherNoise, MismatchesAreWhereTheTextureIsWeak) {
  // Their density falls with (1 − r)², so 1 − 0.5³ of them are on the half with the weaker texture, which a
  // matcher without any on that half leaves out.
  StereoOptions options = small_camera();
  options.spike_fraction = 0.02;
  StereoOptions blank = small_camera();
  blank.dropout_fraction = 0.5;
  std::size_t weak = 0, wrong = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const Points spikes = Wall().capture(options, seed, 0), strong = Wall().capture(blank, seed, 0);
    for (std::size_t i = 0; i < spikes.size(); ++i) {
      if (std::isnan(spikes[i].z())) continue;
      if (std::abs(disparity(options, spikes[i].z()) - disparity(options, 1.2)) < 0.5) continue;
      ++wrong;
      weak += std::isnan(strong[i].z()) ? 1 : 0;
    }
  }
  EXPECT_NEAR(static_cast<double>(weak) / static_cast<double>(wrong), 0.875, 0.02);
}

TEST(MatcherNoise, LosesMoreOfASurfaceWhoseImageHasLittleContrast) {
  StereoOptions options = small_camera();
  options.dropout_fraction = 0.03;
  StereoCamera camera(options);
  const Wall wall;
  std::vector<std::pair<double, std::size_t>> contrast_and_lost;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    std::vector<float> disparities;
    StereoImages images;
    camera.capture(wall.scene, Eigen::Isometry3d::Identity(), seed, 0, disparities, &images);
    double sum = 0, square = 0;
    std::size_t lost = 0;
    for (std::size_t i = 0; i < disparities.size(); ++i) {
      if (i % 320 < 64) continue;
      lost += disparities[i] == 0 ? 1 : 0;
      sum += images.left[i];
      square += images.left[i] * images.left[i];
    }
    const double n = 320.0 * (320 - 64);
    contrast_and_lost.emplace_back(std::sqrt(square / n - sum * sum / n / n) / (sum / n), lost);
  }
  std::sort(contrast_and_lost.begin(), contrast_and_lost.end());
  std::size_t of_plain = 0, of_contrasted = 0;
  for (std::size_t i = 0; i < 50; ++i) {
    of_plain += contrast_and_lost[i].second;
    of_contrasted += contrast_and_lost[contrast_and_lost.size() - 1 - i].second;
  }
  // Lost is what has less grain than some limit: a share of the surface in inverse proportion to its
  // contrast, which is 0.04 to 0.5, on average 0.055 and 0.37 in the lowest and the highest quarter.
  EXPECT_GT(static_cast<double>(of_plain) / static_cast<double>(of_contrasted), 4);
}

TEST(MatcherNoise, GoesWithTheSurface) {
  // The camera is ten pixels further left: a pixel shows another point, and the pixel ten to its right shows
  // the same.
  StereoOptions options = StereoOptions().noise_free();
  options.sigma_d = 0.2;
  options.dropout_fraction = 0.03;
  const Wall wall;
  StereoCamera camera(options);
  const Points first = captured_points(camera, wall.scene, Eigen::Isometry3d::Identity(), 1, 0);
  const Eigen::Isometry3d X_WC(Eigen::Translation3d(-10 * 1.2 / options.focal_px, 0, 0));
  const Points second = captured_points(camera, wall.scene, X_WC, 1, 1);
  // The image has 900,000 px, or about 20,000 independent errors: four standard deviations.
  EXPECT_NEAR(agreement(options, first, second, 1.2).correlation, 0, 0.02);
  const Agreement moved = agreement(options, first, second, 1.2, 10);
  EXPECT_GT(moved.correlation, 0.6);
  EXPECT_LT(moved.one_only, moved.common / 1000);
}

TEST(MatcherNoise, StaysWhileTheCameraSwaysByAFractionOfAPixel) {
  StereoOptions options = StereoOptions().noise_free();
  options.sigma_d = 0.2;
  const Wall wall;
  StereoCamera camera(options);
  const Points first = captured_points(camera, wall.scene, Eigen::Isometry3d::Identity(), 1, 0);
  for (const double pixels : {0.25, 0.5}) {
    const Eigen::Isometry3d X_WC(Eigen::Translation3d(-pixels * 1.2 / options.focal_px, 0, 0));
    const Points second = captured_points(camera, wall.scene, X_WC, 1, 1);
    const double expected = 0.64 * std::exp(-pixels * pixels / (4 * std::pow(options.correlation_px, 2)));
    EXPECT_NEAR(agreement(options, first, second, 1.2).correlation, expected, 0.03) << pixels;
  }
}

/// Share of pixels without a match in the 32 middle columns, over many walls.
double lost_in_the_middle(double distance, double incidence) {
  StereoOptions options = small_camera();
  options.dropout_fraction = 0.03;
  StereoCamera camera(options);
  RayScene scene;
  const Eigen::Isometry3d X_WB = pose(0, 0, distance) *
                                 Eigen::AngleAxisd(incidence, Eigen::Vector3d::UnitY()) *
                                 Eigen::Translation3d(0, 0, 0.01);
  scene.add_fixed({box({40, 40, 0.02}, X_WB)}, Eigen::Isometry3d::Identity());
  std::size_t lost = 0, n = 0;
  for (std::uint64_t seed = 0; seed < 600; ++seed) {
    const Points points = captured_points(camera, scene, Eigen::Isometry3d::Identity(), seed, 0);
    for (int v = 0; v < options.height; ++v) {
      for (int u = 144; u < 176; ++u) {
        lost += std::isnan(point_at(points, options.width, u, v).z()) ? 1 : 0;
        ++n;
      }
    }
  }
  return static_cast<double>(lost) / static_cast<double>(n);
}

// A pixel covers twice the area of a surface inclined by 60 degrees, as much as of one 1.41 times as far
// away. Grain finer than that averages out.
TEST(MatcherNoise, LosesMoreOfWhatIsFarOrSeenAtAnAngle) {
  const double near = lost_in_the_middle(1.2, 0), far = lost_in_the_middle(2, 0),
               inclined = lost_in_the_middle(2, std::numbers::pi / 3),
               farther = lost_in_the_middle(2 * std::numbers::sqrt2, 0);
  EXPECT_NEAR(near, 0.03, 0.003);
  EXPECT_GT(far, 1.2 * near);
  EXPECT_GT(farther, 1.2 * far);
  EXPECT_NEAR(inclined, farther, 0.1 * farther);
}

TEST(MatcherNoise, GrowsWhereASurfaceIsSeenAtAnAngle) {
  // A floor below the camera: disparity b (v − cy) / h in row v, so that its gradient is b / h everywhere.
  for (const double height : {0.065, 0.14, 0.5}) {
    RayScene scene;
    scene.add_fixed({box({20, 0.02, 20}, pose(0, height + 0.01, 5))}, Eigen::Isometry3d::Identity());
    StereoOptions options = StereoOptions().noise_free();
    options.sigma_d = 0.2;
    options.min_depth = 0.01;
    options.max_disparity = 512;
    StereoCamera camera(options);
    const Points points = captured_points(camera, scene, Eigen::Isometry3d::Identity(), 1, 0);
    const double gradient = options.baseline / height;
    double square = 0;
    std::size_t seen = 0;
    for (int v = 560; v < 900; ++v) {
      for (int u = 512; u < 1024; ++u) {
        const double error =
            disparity(options, point_at(points, 1024, u, v).z()) - gradient * (v - options.cy);
        if (std::isnan(error)) continue;
        ++seen;
        square += error * error;
      }
    }
    if (gradient > 1) {
      EXPECT_EQ(seen, 0U);
      continue;
    }
    EXPECT_GT(seen, 170'000U) << height;
    EXPECT_NEAR(std::sqrt(square / static_cast<double>(seen)), std::hypot(0.2, 0.5 * gradient),
                0.02 * std::hypot(0.2, 0.5 * gradient))
        << height;
  }
}

TEST(MatcherNoise, ForegroundGrowsByHalfTheWindow) {
  StereoOptions options = StereoOptions().noise_free();
  const Wall wall(true);
  const Points thin = wall.capture(options, 1, 0);
  options.fattening_px = 3;
  const Points fat = wall.capture(options, 1, 0);
  // The box's front: 0.2 m wide at 0.6 m.
  const double half = 0.1 / 0.6 * options.focal_px;
  const int left = static_cast<int>(std::ceil(options.cx - half));
  const int right = static_cast<int>(std::floor(options.cx + half));
  const auto is_front = [](const Points& points, int u, int v) {
    return std::abs(point_at(points, 1024, u, v).z() - 0.6F) < 1e-4F;
  };
  for (const int shift : {-4, -3, -1, 0}) {
    EXPECT_EQ(is_front(thin, left + shift, 512), shift == 0) << shift;
    EXPECT_EQ(is_front(fat, left + shift, 512), shift >= -3) << shift;
    EXPECT_EQ(is_front(fat, right - shift, 512), shift >= -3) << shift;
    EXPECT_EQ(is_front(fat, 512, left + shift), shift >= -3) << shift;  // the box and the image are square
    EXPECT_EQ(is_front(fat, left + shift, left + shift), shift >= -3) << shift;
  }
  // To the left of the box is the area that it hides from the right camera, as wide as the difference of the
  // disparities.
  const double shadow = disparity(options, 0.6) - disparity(options, 1.2);
  EXPECT_TRUE(std::isnan(fat[static_cast<std::size_t>(512 * 1024 + left - 5)].z()));
  EXPECT_TRUE(std::isnan(fat[static_cast<std::size_t>(512 * 1024 + left - static_cast<int>(shadow))].z()));
  EXPECT_NEAR(fat[static_cast<std::size_t>(512 * 1024 + left - static_cast<int>(shadow) - 2)].z(), 1.2F,
              1e-4F);
}

/// A floor, whose disparity changes from row to row, has no edge.
TEST(MatcherNoise, ASlopeDoesNotGrow) {
  for (const double height : {0.1, 0.3, 0.7}) {
    RayScene scene;
    scene.add_fixed({box({20, 0.02, 20}, pose(0, height + 0.01, 5))}, Eigen::Isometry3d::Identity());
    StereoOptions options = StereoOptions().noise_free();
    StereoCamera ideal(options);
    options.fattening_px = 3;
    StereoCamera widening(options);
    const Points thin = captured_points(ideal, scene, Eigen::Isometry3d::Identity(), 1, 0);
    const Points fat = captured_points(widening, scene, Eigen::Isometry3d::Identity(), 1, 0);
    std::size_t seen = 0;
    for (int v = 600; v < 1000; ++v) {
      for (int u = 200; u < 1000; ++u) {
        if (std::isnan(point_at(thin, 1024, u, v).z())) continue;
        ++seen;
        ASSERT_EQ(point_at(fat, 1024, u, v), point_at(thin, 1024, u, v)) << height << ", " << u << ", " << v;
      }
    }
    EXPECT_GT(seen, 50'000U) << height;
  }
}

TEST(MatcherNoise, IsReproducibleWhateverTheThreads) {
  const Wall wall(true);
  StereoOptions options;
  options.width = 500;
  options.height = 333;
  options.cx = 249.5;
  options.cy = 166;
  options.focal_px = 300;
  options.threads = 1;
  const Points reference = wall.capture(options, 11, 3);
  EXPECT_TRUE(same_bytes(reference, wall.capture(options, 11, 3)));
  for (const int threads : {2, 5}) {
    options.threads = threads;
    EXPECT_TRUE(same_bytes(reference, wall.capture(options, 11, 3))) << threads;
  }
  EXPECT_FALSE(same_bytes(reference, wall.capture(options, 12, 3)));
  EXPECT_FALSE(same_bytes(reference, wall.capture(options, 11, 4)));

  // A camera that has captured other frames before produces the same frame.
  StereoCamera camera(options);
  Points points;
  for (const std::uint64_t frame : {0, 1, 2, 3}) {
    points = captured_points(camera, wall.scene, Eigen::Isometry3d::Identity(), 11, frame);
  }
  EXPECT_TRUE(same_bytes(reference, points));
}

TEST(MatcherNoise, TermsDoNotDisturbEachOther) {
  // With the same seed, enabling dropout removes points and leaves the noise of the others unchanged.
  const Wall wall;
  StereoOptions options;
  options.dropout_fraction = 0;
  const Points all = wall.capture(options, 1, 0);
  options.dropout_fraction = 0.1;
  const Points some = wall.capture(options, 1, 0);
  std::size_t lost = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (std::isnan(some[i].z())) {
      lost += std::isnan(all[i].z()) ? 0 : 1;
    } else {
      ASSERT_EQ(some[i], all[i]);
    }
  }
  EXPECT_GT(lost, 50'000U);
}

}  // namespace
}  // namespace walkman::sensors
