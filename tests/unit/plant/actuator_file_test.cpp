#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "emulator/plant/actuators/actuator_parameters.h"

namespace walkman::plant {
namespace {

using ::testing::HasSubstr;

/// The folder of the product's actuator classes with one file changed.
class ActuatorFiles : public ::testing::Test {
 protected:
  ActuatorFiles() {
    std::filesystem::remove_all(folder_);
    std::filesystem::copy(shipped(), folder_);
  }
  ~ActuatorFiles() override { std::filesystem::remove_all(folder_); }

  static std::filesystem::path shipped() {
    return std::filesystem::path(WALKMAN_URDF_DIR) / "../emulator/plant/actuators";
  }
  /// Returns the error for `small.yaml` with the line of `key` replaced (or, without a key, `line` added).
  std::string refusal(const std::string& key, const std::string& line) {
    std::ifstream in(shipped() / "small.yaml");
    std::ofstream out(folder_ / "small.yaml");
    for (std::string text; std::getline(in, text);) {
      const bool chosen = !key.empty() && text.rfind(key + ":", 0) == 0;
      if (!chosen || !line.empty()) out << (chosen ? line : text) << '\n';
    }
    if (key.empty()) out << line << '\n';
    out.close();
    try {
      (void)load_actuators(folder_);
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "accepted";
  }
  std::filesystem::path folder_ = std::filesystem::path(::testing::TempDir()) /
                                  ::testing::UnitTest::GetInstance()->current_test_info()->name();
};

TEST_F(ActuatorFiles, ShippedFolderHasEveryClassOfTheRobot) {
  const auto classes = load_actuators(shipped());
  for (const char* name : {"big", "medium", "medium2", "small", "hand"})
    EXPECT_TRUE(classes.contains(name)) << name;
  EXPECT_DOUBLE_EQ(classes.at("medium2").spring_constant, 1300);
}

TEST_F(ActuatorFiles, RefusalsNameFileLineAndKey) {
  EXPECT_THAT(refusal("backlash", "backlsah: 0"),
              HasSubstr("backlsah: unknown key; did you mean \"backlash\""));
  EXPECT_THAT(refusal("backlash", "backlsah: 0"), ::testing::ContainsRegex("small.yaml:[0-9]+: "));
  EXPECT_THAT(refusal("backlash", ""), HasSubstr("the key \"backlash\" is missing"));
  EXPECT_THAT(refusal("motor_inertia", "motor_inertia: .nan"), HasSubstr("expected a number"));
  EXPECT_THAT(refusal("motor_inertia", "motor_inertia: 0"),
              HasSubstr("motor_inertia: found 0, expected more than 0"));
  EXPECT_THAT(refusal("motor_inertia", "motor_inertia: heavy"), HasSubstr("expected a number"));
  EXPECT_THAT(refusal("", "backlash: 0"), HasSubstr("backlash: the key appears twice"));
  EXPECT_THAT(refusal("static_friction", "static_friction: 0"),
              HasSubstr("expected at least coulomb_friction"));
  EXPECT_THAT(refusal("continuous_torque", "continuous_torque: 1000"),
              HasSubstr("expected at most peak_torque"));
  EXPECT_THAT(refusal("backlash", "- 1"), HasSubstr("not well-formed YAML"));
  EXPECT_THAT(refusal("backlash", "backlash: -1"), HasSubstr("backlash: found -1, expected 0 or more"));
}

TEST_F(ActuatorFiles, MissingFolderIsNamed) {
  EXPECT_THROW((void)load_actuators(folder_ / "nowhere"), std::runtime_error);
}

}  // namespace
}  // namespace walkman::plant
