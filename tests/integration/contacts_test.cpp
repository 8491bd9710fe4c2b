// What the robot touches in a whole run of Experiment 1, by the plant's truth.

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
  o.parameters = kTree / "adaptation/parameters.yaml";
  o.actuators = kTree / "emulator/plant/actuators";
  o.seed = seed;
  return o;
}

TEST(Contacts, TheRobotTouchesNeitherItselfNorTheTable) {
  const RepetitionResult result = run_repetition(options(kTree / "urdf/scenes/experiment_1.yaml", 7));
  EXPECT_EQ(result.reason, "");
  EXPECT_THAT(result.touches, testing::IsEmpty());
}

// A table that stands where the robot's fingers are.
TEST(Contacts, ATableInTheWayIsNoticed) {
  std::ifstream in(kTree / "urdf/scenes/experiment_1.yaml");
  std::string text((std::istreambuf_iterator<char>(in)), {});
  const std::string urdf = std::filesystem::absolute(kTree / "urdf").string();
  const auto replace = [&text](const std::string& from, const std::string& to) {
    ASSERT_NE(text.find(from), std::string::npos) << from;
    text.replace(text.find(from), from.size(), to);
  };
  replace("file: ../", "file: " + urdf + "/");
  replace("urdf: room.urdf", "urdf: " + urdf + "/scenes/room.urdf");
  replace("urdf: table.urdf", "urdf: " + urdf + "/scenes/table.urdf");
  for (int i = 0; i < 3; ++i) replace("urdf: ../", "urdf: " + urdf + "/");
  replace("xyz_m: [0.90, 0, 0]", "xyz_m: [0.76, 0, 0]");
  const std::filesystem::path scene = std::filesystem::path(testing::TempDir()) / "walkman_near_table.yaml";
  std::ofstream(scene) << text;
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
