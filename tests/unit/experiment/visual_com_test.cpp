#include <chrono>
#include <cstdint>
#include <string>

#include <gtest/gtest.h>

#include "adaptation/perception/stage_one.h"
#include "apps/experiment/object_volume.h"
#include "apps/shared/emulated_world.h"
#include "emulator/plant/dynamics/world_objects.h"

namespace walkman::apps {
namespace {

class VisualCom : public testing::TestWithParam<int> {};

TEST_P(VisualCom, OfTheVolumeIsAtMostHalfAsFarOff) {
  const std::string tree = WALKMAN_SOURCE_TREE;
  for (const std::uint64_t seed : {1, 2, 3}) {
    WorldOptions options;
    options.scene = tree + "/urdf/scenes/experiment_" + std::to_string(GetParam()) + ".yaml";
    options.actuators = tree + "/emulator/plant/actuators";
    options.seed = seed;
    EmulatedWorld world(options);
    Emulator& emulator = world.emulator;
    camera::OrganizedCloud cloud;
    EmbeddedCamera camera(emulator);
    while (!camera.client.latest(Time{}, cloud))
      emulator.advance(emulator.now() + std::chrono::milliseconds(5));
    MethodParameters parameters = load_method_parameters(tree + "/adaptation/parameters.yaml");
    const Eigen::Isometry3d X_CO = emulator.camera().exposure().X_WC.inverse() * emulator.plant().X_WO(0);
    const Eigen::Vector3d truth_C = X_CO * volume_centroid(plant::with_weights(world.scene.objects.front()));
    const auto error = [&](Look how) {
      parameters.stage_one.look = how;
      const auto seen = perception::locate(cloud, parameters.stage_one, X_CO.translation());
      return (seen.object().p_CCm - truth_C).norm();
    };
    EXPECT_LE(error(Look::kAround), 0.5 * error(Look::kOnce)) << "seed " << seed;
  }
}

// The image's border cuts the others' where the head begins: tests/integration/look_around_test.py turns it.
INSTANTIATE_TEST_SUITE_P(Experiments, VisualCom, testing::Values(6, 7, 8, 9, 11));

}  // namespace
}  // namespace walkman::apps
