#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "adaptation/regrasp/stage_two_parameters.h"

namespace walkman::regrasp {
namespace {

using ::testing::HasSubstr;

std::filesystem::path written(const std::string& text) {
  const std::filesystem::path file = ::testing::TempDir() + "regrasp_parameters.yaml";
  std::ofstream(file) << text;
  return file;
}

std::string refusal(const std::string& text) {
  try {
    (void)load_parameters(written(text));
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "accepted";
}

TEST(Parameters, PapersValuesAreTheDefaults) {
  const Parameters p = load_parameters(std::string(WALKMAN_URDF_DIR) + "/../adaptation/parameters.yaml");
  EXPECT_DOUBLE_EQ(p.stage_two.torque_threshold, 0.02);
  EXPECT_DOUBLE_EQ(p.stage_two.displacement_threshold, 0.02);
  EXPECT_DOUBLE_EQ(p.stage_two.average_time, 2.0);
  EXPECT_DOUBLE_EQ(p.stage_one.reach, 1.5);
  const StageTwoParameters code;
  EXPECT_DOUBLE_EQ(p.stage_two.lift_height, code.lift_height);
  EXPECT_DOUBLE_EQ(p.stage_two.grip_torque, code.grip_torque);
  EXPECT_DOUBLE_EQ(p.stage_two.travel_speed, code.travel_speed);
}

TEST(Parameters, GivenOnesReplaceDefaults) {
  const Parameters p = load_parameters(written("stage_two:\n  lift_height: 0.1\n  max_regrasps: 1\n"));
  EXPECT_DOUBLE_EQ(p.stage_two.lift_height, 0.1);
  EXPECT_EQ(p.stage_two.max_regrasps, 1);
  EXPECT_DOUBLE_EQ(p.stage_one.reach, 1.5);
}

TEST(Parameters, WhatIsWrongIsNamedWithFileLineAndKey) {
  EXPECT_THAT(refusal("stage_two:\n  lift_hieght: 0.1\n"),
              HasSubstr("regrasp_parameters.yaml:2: stage_two: unknown key "
                        "'lift_hieght'"));
  EXPECT_THAT(refusal("stage_two:\n  lift_height: -1\n"),
              HasSubstr("lift_height must be a number from 0 to 1"));
  EXPECT_THAT(refusal("stage_two:\n  settle_time: 1e9\n"),
              HasSubstr("settle_time must be a number from 0 to 60"));
  EXPECT_THAT(refusal("stage_two:\n  average_time: 0\n"),
              HasSubstr("average_time must be a number from 0.02"));
  EXPECT_THAT(refusal("stage_two:\n  lift_speed: .nan\n"), HasSubstr("lift_speed must be a number"));
  EXPECT_THAT(refusal("stage_two:\n  max_regrasps: 1.5\n"), HasSubstr("max_regrasps must be a whole number"));
  EXPECT_THAT(refusal("stage_one:\n  reach: 1\nstage_three:\n  x: 1\n"), HasSubstr(":3: 'stage_three'"));
  EXPECT_THAT(refusal("stage_two: 3\n"), HasSubstr("stage_two"));
}

}  // namespace
}  // namespace walkman::regrasp
