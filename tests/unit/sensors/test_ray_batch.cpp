#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "sensors/ray_batch.h"
#include "sensors/ray_scene.h"
#include "sensors/ray_scene_access.h"
#include "tests/unit/sensors/analytic_shapes.h"

namespace walkman::sensors {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
const Eigen::Vector3d kSize(0.3, 0.2, 0.1);
const Eigen::Isometry3d kX_WB = pose(0.05, -0.02, 1);
const Eigen::Vector3f kOrigin(0.01F, 0.02F, -0.1F);

void add_box(RayScene& scene) { scene.add_fixed({box(kSize, kX_WB)}, Eigen::Isometry3d::Identity()); }

/// Rays side by side from left to right, some of which hit the box.
Eigen::Vector3f direction(int ray) { return {-0.3F + 0.005F * static_cast<float>(ray), 0.01F, 1}; }

double depth_of_box(int ray) {
  return cast_box(kSize, kX_WB.inverse() * kOrigin.cast<double>(),
                  kX_WB.linear().transpose() * direction(ray).cast<double>(), 0);
}

void aim(RayBatch& batch, int rays) {
  batch.set_origin(kOrigin);
  for (int i = 0; i < rays; ++i) {
    const RayBatch::Group group = batch.group(i / RayBatch::kGroup);
    const int lane = i % RayBatch::kGroup;
    const Eigen::Vector3f d = direction(i);
    group.dir_x[lane] = d.x();
    group.dir_y[lane] = d.y();
    group.dir_z[lane] = d.z();
    group.tnear[lane] = 0;
    group.tfar[lane] = kInfinity;
  }
}

/// Whatever the width of packets, and also where the last packet is not full.
class RayBatchTest : public testing::TestWithParam<int> {};

TEST_P(RayBatchTest, HitsWhatIsThere) {
  RayScene scene;
  add_box(scene);
  for (const int rays : {1, 8, 9, 16, 17, 60, 120}) {
    RayBatch batch(rays, GetParam());
    for (int pass = 0; pass < 2; ++pass) {
      batch.begin(RaySceneAccess::embree_scene(scene));
      aim(batch, rays);
      batch.intersect(rays);
      for (int i = 0; i < rays; ++i) {
        const RayBatch::Group group = batch.group(i / RayBatch::kGroup);
        const int lane = i % RayBatch::kGroup;
        const double expected = depth_of_box(i);
        if (std::isinf(expected)) {
          EXPECT_EQ(group.tfar[lane], kInfinity) << i << " of " << rays;
          EXPECT_EQ(group.geometry[lane], RayBatch::kNothing);
        } else {
          EXPECT_NEAR(static_cast<double>(group.tfar[lane]), expected, 1e-5) << i << " of " << rays;
          EXPECT_EQ(group.geometry[lane], RaySceneAccess::kFixed);
          EXPECT_LT(group.triangle[lane], 12U);
        }
        EXPECT_EQ(group.instance[lane], RayBatch::kNothing);
      }
    }
  }
}

TEST_P(RayBatchTest, SeesWhatIsOnTheWay) {
  RayScene scene;
  add_box(scene);
  for (const int rays : {1, 7, 16, 23, 120}) {
    RayBatch batch(rays, GetParam());
    batch.begin(RaySceneAccess::embree_scene(scene));
    aim(batch, rays);
    int hidden = 0;
    for (int i = 0; i < rays; i += 2) batch.group(i / RayBatch::kGroup).tfar[i % RayBatch::kGroup] = 0.5F;
    batch.occlude(rays);
    for (int i = 0; i < rays; ++i) {
      const bool on_the_way = i % 2 == 1 && std::isfinite(depth_of_box(i));
      EXPECT_EQ(batch.group(i / RayBatch::kGroup).tfar[i % RayBatch::kGroup] < 0, on_the_way) << i;
      hidden += on_the_way ? 1 : 0;
    }
    EXPECT_EQ(hidden > 0, rays > 60);
  }
}

INSTANTIATE_TEST_SUITE_P(Widths, RayBatchTest, testing::Values(0, 8, 16));

}  // namespace
}  // namespace walkman::sensors
