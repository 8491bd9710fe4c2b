#include "adaptation/perception/sampling.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "tests/unit/perception/analytic_scene.h"

namespace walkman::perception {
namespace {

// Disparity noise σ is noise σ / (f b) of the inverse depth; that of the inverse range is smaller by the
// ray's cosine, whose mean over the image is 0.9.
TEST(Sampling, FollowsNoiseAndResolutionOfAStereoCamera) {
  for (const int size : {512, 1024}) {
    const test::TestCamera camera = test::camera_of(size);
    const auto disparity = test::true_disparity(test::bar_on_table(0.1, 0.02), camera);
    for (const double sigma : {0.1, 0.2, 0.4}) {
      test::TestNoise noise;
      noise.sigma = sigma;
      const auto sampling =
          measure_sampling(test::to_cloud(test::with_noise(disparity, camera, noise), camera), 1.5);
      const double expected = sigma / (camera.focal * camera.baseline);
      // Rounding to 1/16 px and mismatches increase it.
      EXPECT_NEAR(sampling.noise, 0.95 * expected, 0.2 * expected) << size << " px, " << sigma;
      EXPECT_NEAR(sampling.step, 0.9 / camera.focal, 0.12 / camera.focal);
    }
  }
}

TEST(Sampling, NoiseFreeCloudHasNone) {
  const auto sampling = measure_sampling(test::to_cloud(test::plain_bar_disparity(), {}), 1.5);
  EXPECT_LT(sampling.noise, 2e-6);
  EXPECT_NEAR(sampling.step, 0.9 / 588.8, 0.1 / 588.8);
}

TEST(Sampling, UnorganizedCloudTellsItsOwn) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> side(-0.4, 0.4);
  for (const double deviation : {0.001, 0.004}) {
    std::normal_distribution<double> noise(0, deviation);
    camera::OrganizedCloud cloud;
    // 40 000 points on 0.64 m² at a distance of 1 m: 4 mm apart.
    for (int i = 0; i < 40000; ++i) {
      const Eigen::Vector3d p(side(random), side(random), 1);
      cloud.points.push_back((p * (1 + noise(random) / p.norm())).cast<float>());
    }
    cloud.width = 40000;
    cloud.height = 1;
    const auto sampling = measure_sampling(cloud, 1.5);
    EXPECT_NEAR(sampling.deviation(1.05), deviation, 0.25 * deviation);
    EXPECT_NEAR(sampling.spacing(1.05), 0.004, 0.001);
  }
  EXPECT_EQ(measure_sampling({}, 1.5).step, 0);
}

}  // namespace
}  // namespace walkman::perception
