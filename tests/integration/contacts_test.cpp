// Contacts of the robot in a whole run of Experiment 1, by the plant's ground truth.

#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/experiment/repetition.h"
#include "apps/experiment/touches.h"
#include "emulator/emulator.h"

namespace walkman::apps {
namespace {

const std::filesystem::path kTree = WALKMAN_SOURCE_TREE;

RepetitionOptions options(const std::filesystem::path& scene, std::uint64_t seed) {
  RepetitionOptions o;
  o.scene = scene;
  o.parameters = kTree / "adaptation/head_at_home.yaml";
  o.actuators = kTree / "emulator/plant/actuators";
  o.seed = seed;
  return o;
}

TEST(Contacts, TheRobotTouchesNeitherItselfNorTheTable) {
  const RepetitionResult result = run_repetition(options(kTree / "urdf/scenes/experiment_1.yaml", 7));
  EXPECT_EQ(result.reason, "");
  EXPECT_THAT(result.touches, testing::IsEmpty());
}

// A table at the place of the robot's fingers.
TEST(Contacts, ATableInTheWayIsNoticed) {
  const std::string urdf = std::filesystem::absolute(kTree / "urdf").string();
  const std::filesystem::path scene = std::filesystem::path(testing::TempDir()) / "walkman_near_table.yaml";
  std::ofstream(scene) << "extends: " << urdf << "/scenes/experiment_1.yaml\n"
                       << "fixed_bodies: [{name: table, xyz_m: [0.851, 0, 0]}]\n";
  RepetitionOptions o = options(scene, 1);
  Emulator* emulator = nullptr;
  o.prepare = [&](Emulator& e) { emulator = &e; };
  TouchWatch watch(KnownRobot(load_robot_description(urdf + "/walkman.robot.yaml")), "bar");
  o.progress = [&](const Progress& progress) {
    watch.look(emulator->plant(), progress.phase);
    if (progress.simulated_seconds > 1) throw std::runtime_error("enough");
  };
  EXPECT_THROW(static_cast<void>(run_repetition(o)), std::logic_error);
  ASSERT_FALSE(watch.touches().empty());
  EXPECT_EQ(watch.touches().front().other, "table");
  EXPECT_THAT(to_string(watch.touches().front()),
              testing::MatchesRegex(".+ touched table with .+ N at .+ s, in .+"));
}

}  // namespace
}  // namespace walkman::apps
