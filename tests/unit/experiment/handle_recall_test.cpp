#include <numbers>

#include <gtest/gtest.h>

#include "adaptation/perception/stage_one.h"
#include "emulator/plant/dynamics/world_objects.h"
#include "tests/unit/experiment/first_look.h"
#include "tests/unit/experiment/handle_score.h"

namespace walkman::apps {
namespace {

constexpr double kAxisError = 3 * std::numbers::pi / 180, kRadiusError = 0.003;  // m

/// Scores a scene seen by the noisy camera of a robot that differs slightly from its model.
Scored look(int experiment, std::uint64_t seed) {
  const FirstLook first(experiment, seed);
  const auto pieces =
      pieces_of(plant::with_weights(first.world.scene.objects.front()), first.X_CO, first.parameters);
  const auto seen = perception::locate(first.cloud, first.parameters, first.X_CO.translation());
  return scored(pieces, seen.object().handles);
}

class HandleRecall : public testing::TestWithParam<int> {};

TEST_P(HandleRecall, OfWhatCanBeGraspedAndNothingElse) {
  int graspable = 0, found = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Scored s = look(GetParam(), seed);
    SCOPED_TRACE(::testing::Message()
                 << "seed " << seed << ": " << s.found << " of " << s.graspable << " cm");
    EXPECT_GT(s.graspable, 0);
    // With fewer centimetres, one is more than a twentieth.
    if (s.graspable >= 20) {
      EXPECT_GE(s.found, 0.95 * s.graspable);
    }
    EXPECT_EQ(s.wrong, 0);
    EXPECT_LE(s.worst_axis, kAxisError);
    EXPECT_LE(s.worst_radius, kRadiusError);
    graspable += s.graspable;
    found += s.found;
  }
  EXPECT_GE(found, 0.95 * graspable) << found << " of " << graspable << " cm";
}

INSTANTIATE_TEST_SUITE_P(Experiments, HandleRecall, testing::Range(1, 12));

}  // namespace
}  // namespace walkman::apps
