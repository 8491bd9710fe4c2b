#include <algorithm>
#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

#include "adaptation/perception/stage_one.h"
#include "tests/unit/perception/analytic_scene.h"

namespace walkman::perception {
namespace {

using test::Bar;
using test::kDegree;

TEST(Locate, FindsTheBarInANoiseFreeCloud) {
  const auto result = locate(test::to_cloud(test::plain_bar_disparity(), {}), {});
  const Bar& bar = test::plain_bar().bars.front();
  EXPECT_LT(std::acos(std::min(1.0, result.plane.n_C.dot(test::plain_bar().up))), 0.01 * kDegree);
  EXPECT_NEAR(result.plane.offset, test::plain_bar().table_offset, 1e-4);
  ASSERT_EQ(result.object().handles.size(), 1U);
  const Handle& handle = result.object().handles.front();
  EXPECT_LT(angle_to(handle, bar), 0.05 * kDegree);
  EXPECT_LT(offset_from(handle, bar), 2e-4);
  EXPECT_NEAR(handle.radius, bar.radius, 2e-4);
  EXPECT_GT(handle.axis_C.x(), 0);
  EXPECT_NEAR(handle.from, -bar.length() / 2, 0.006);
  EXPECT_NEAR(handle.to, bar.length() / 2, 0.006);
  EXPECT_GE(coverage(handle, bar, 0), 0.95);
  // Only the upper side is visible: the visual CoM lies between axis and surface, midway along the bar.
  EXPECT_NEAR((result.object().p_CCm - bar.start).dot(bar.axis()), bar.length() / 2, 0.02);
  EXPECT_LT((result.object().p_CCm - bar.start).cross(bar.axis()).norm(), bar.radius);
}

class NoisySeed : public testing::TestWithParam<int> {};

TEST_P(NoisySeed, MeetsTheAccuracyTargets) {
  StageOneParameters parameters;
  parameters.seed = static_cast<std::uint64_t>(GetParam());
  const auto result = locate(test::noisy(test::plain_bar_disparity(), 0.2, parameters.seed), parameters);
  const Bar& bar = test::plain_bar().bars.front();
  ASSERT_EQ(result.object().handles.size(), 1U);
  const Handle& handle = result.object().handles.front();
  EXPECT_LT(angle_to(handle, bar), 0.3 * kDegree);
  EXPECT_LT(offset_from(handle, bar), 2e-3);
  EXPECT_NEAR(handle.radius, bar.radius, 2e-3);
  EXPECT_GE(coverage(handle, bar, handle.reach), 0.99);
  EXPECT_GE(coverage(handle, bar, 0), 0.95);
  EXPECT_NEAR((result.object().p_CCm - bar.start).dot(bar.axis()), bar.length() / 2, 0.05);
}

INSTANTIATE_TEST_SUITE_P(TenSeeds, NoisySeed, testing::Range(1, 11));

}  // namespace
}  // namespace walkman::perception
