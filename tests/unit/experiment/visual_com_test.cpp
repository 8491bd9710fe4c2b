#include <cstdint>

#include <gtest/gtest.h>

#include "adaptation/perception/stage_one.h"
#include "apps/experiment/judge.h"
#include "emulator/plant/dynamics/world_objects.h"
#include "tests/unit/experiment/first_look.h"

namespace walkman::apps {
namespace {

class VisualCom : public testing::TestWithParam<int> {};

TEST_P(VisualCom, OfTheVolumeIsAtMostHalfAsFarOff) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    FirstLook first(GetParam(), seed);
    const Eigen::Vector3d truth_C =
        first.X_CO * volume_centroid(plant::with_weights(first.world.scene.objects.front()));
    const auto error = [&](Look how) {
      first.parameters.look = how;
      const auto seen = perception::locate(first.cloud, first.parameters, first.X_CO.translation());
      return (seen.object().p_CCm - truth_C).norm();
    };
    EXPECT_LE(error(Look::kAround), 0.5 * error(Look::kOnce)) << "seed " << seed;
  }
}

// In the others the image border cuts the object at the head's initial pose:
// tests/integration/look_around_test.py turns the head.
INSTANTIATE_TEST_SUITE_P(Experiments, VisualCom, testing::Values(6, 7, 8, 9, 11));

}  // namespace
}  // namespace walkman::apps
