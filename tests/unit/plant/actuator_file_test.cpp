#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "emulator/plant/series_elastic_actuator.h"

namespace walkman::plant {
namespace {

using ::testing::HasSubstr;

std::string refusal(const std::string& text) {
  const std::string file = ::testing::TempDir() + "actuators.yaml";
  std::ofstream(file) << text;
  try {
    (void)load_actuators(file);
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "accepted";
}

TEST(ActuatorFile, ShippedOneHasEveryClassOfTheRobot) {
  const auto classes = load_actuators(std::string(WALKMAN_URDF_DIR) + "/../emulator/plant/actuators.yaml");
  for (const char* name : {"big", "medium", "medium2", "small", "hand"})
    EXPECT_TRUE(classes.contains(name)) << name;
  EXPECT_DOUBLE_EQ(classes.at("medium2").spring_constant, 1300);
}

TEST(ActuatorFile, NamesFileLineAndKeyOfWhatIsWrong) {
  EXPECT_THAT(refusal("small:\n  motor_inertai: 0.1\n"),
              HasSubstr("actuators.yaml:2: actuator class 'small': unknown "
                        "key 'motor_inertai'"));
  EXPECT_THAT(refusal("small:\n  motor_inertia: .nan\n"), HasSubstr("motor_inertia must be a finite number"));
  EXPECT_THAT(refusal("small:\n  motor_inertia: 0.1\n"), HasSubstr("has 1 of 10 keys"));
  EXPECT_THAT(refusal("- small\n"), HasSubstr("expected a map"));
  EXPECT_THAT(refusal("small: [1, 2\n"), HasSubstr("cannot read"));
}

}  // namespace
}  // namespace walkman::plant
