#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <numbers>

#include <gtest/gtest.h>

#include "adaptation/perception/stage_one.h"
#include "emulator/plant/dynamics/world_objects.h"
#include "tests/unit/experiment/first_look.h"
#include "tests/unit/experiment/handle_score.h"

namespace walkman::apps {
namespace {

/// Effect of each filter on the handles and on the visual centre of mass. The table is in
/// docs/architecture.md.
TEST(FilterSteps, KeepHandlesFromBeingMissed) {
  struct Setting {
    const char* name;
    bool removes, smooths;
    Scored sum{};
    double centre = 0, farthest = 0;  // m, shift of the visual centre of mass: mean and maximum
  };
  Setting settings[] = {{"both", true, true},
                        {"no outlier removal", false, true},
                        {"no smoothing", true, false},
                        {"neither", false, false}};
  constexpr int kExperiments = 11;
  constexpr std::uint64_t kSeeds = 3;
  for (int look = 0; look < kExperiments * static_cast<int>(kSeeds); ++look) {
    FirstLook first(1 + look % kExperiments, 1 + static_cast<std::uint64_t>(look / kExperiments));
    const auto pieces =
        pieces_of(plant::with_weights(first.world.scene.objects.front()), first.X_CO, first.parameters);
    Eigen::Vector3d with_both = Eigen::Vector3d::Zero();
    for (Setting& setting : settings) {
      StageOneParameters parameters = first.parameters;
      if (!setting.removes) parameters.outlier_neighbours = 0;
      if (!setting.smooths) parameters.smoothing_radius = 0;
      const auto seen = perception::locate(first.cloud, parameters, first.X_CO.translation());
      const Scored s = scored(pieces, seen.object().handles);
      Scored& sum = setting.sum;
      sum.graspable += s.graspable;
      sum.found += s.found;
      sum.wrong += s.wrong;
      sum.worst_axis = std::max(sum.worst_axis, s.worst_axis);
      sum.worst_radius = std::max(sum.worst_radius, s.worst_radius);
      if (&setting == settings) with_both = seen.object().p_CCm;
      const double moved = (seen.object().p_CCm - with_both).norm();
      setting.centre += moved / (kExperiments * static_cast<double>(kSeeds));
      setting.farthest = std::max(setting.farthest, moved);
    }
  }
  std::printf("%-20s %14s %12s %10s %11s %24s\n", "filters", "found, cm", "wrong places", "axis, deg",
              "radius, mm", "centre moved, mm (most)");
  for (const Setting& s : settings) {
    std::printf("%-20s %5d of %5d %12d %10.1f %11.1f %16.1f (%5.1f)\n", s.name, s.sum.found, s.sum.graspable,
                s.sum.wrong, s.sum.worst_axis * 180 / std::numbers::pi, s.sum.worst_radius * 1e3,
                s.centre * 1e3, s.farthest * 1e3);
  }
  EXPECT_GE(settings[0].sum.found, 0.95 * settings[0].sum.graspable);
  EXPECT_LT(settings[2].sum.found, settings[0].sum.found);
  EXPECT_LT(settings[3].sum.found, settings[2].sum.found);
}

}  // namespace
}  // namespace walkman::apps
