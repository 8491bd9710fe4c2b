#include "adaptation/parameters.h"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

namespace walkman {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

class ParameterFile : public testing::Test {
 protected:
  void SetUp() override {
    file_ =
        fs::path(testing::TempDir()) /
        (std::string("walkman_") + testing::UnitTest::GetInstance()->current_test_info()->name() + ".yaml");
  }
  void TearDown() override { fs::remove(file_); }

  [[nodiscard]] MethodParameters load(const std::string& text) const {
    std::ofstream(file_) << text;
    return load_method_parameters(file_);
  }
  [[nodiscard]] std::string error(const std::string& text) const {
    try {
      static_cast<void>(load(text));
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "none";
  }
  [[nodiscard]] std::string stage_one_error(const std::string& line) const {
    return error("stage_one:\n  " + line + "\n");
  }
  [[nodiscard]] std::string stage_two_error(const std::string& line) const {
    return error("stage_two:\n  " + line + "\n");
  }

  fs::path file_;
};

TEST_F(ParameterFile, GivenKeysReplaceDefaults) {
  const auto p = load(
      "stage_one:\n  reach: 1.2\n  handle_samples: 500\n  seed: 9\n"
      "stage_two:\n  lift_height: 0.1\n  max_regrasps: 1\n");
  EXPECT_DOUBLE_EQ(p.stage_one.reach, 1.2);
  EXPECT_EQ(p.stage_one.handle_samples, 500);
  EXPECT_EQ(p.stage_one.seed, 9U);
  EXPECT_DOUBLE_EQ(p.stage_one.handle_gap, StageOneParameters{}.handle_gap);
  EXPECT_DOUBLE_EQ(p.stage_two.lift_height, 0.1);
  EXPECT_EQ(p.stage_two.max_regrasps, 1);
}

TEST_F(ParameterFile, WhatIsNotThereKeepsItsDefault) {
  for (const char* text : {"# nothing\n", "stage_one:\nstage_two:\n", "stage_two: {lift_height: 0.08}\n"})
    EXPECT_DOUBLE_EQ(load(text).stage_one.reach, 1.5) << text;
  EXPECT_DOUBLE_EQ(load("stage_one: {reach: 1}\n").stage_two.average_time, 2);
}

TEST(ParameterDefaults, ShippedFileHoldsEveryKeyOfStageOneAtItsDefault) {
  const fs::path shipped = fs::path(WALKMAN_SOURCE_TREE) / "adaptation/parameters.yaml";
  const StageOneParameters file = load_method_parameters(shipped).stage_one, code;
  EXPECT_EQ(file.look, code.look);
  EXPECT_EQ(file.reach, code.reach);
  EXPECT_EQ(file.plane_distance, code.plane_distance);
  EXPECT_EQ(file.plane_deviations, code.plane_deviations);
  EXPECT_EQ(file.plane_normal_angle, code.plane_normal_angle);
  EXPECT_EQ(file.plane_iterations, code.plane_iterations);
  EXPECT_EQ(file.plane_min_share, code.plane_min_share);
  EXPECT_EQ(file.above_plane, code.above_plane);
  EXPECT_EQ(file.above_plane_deviations, code.above_plane_deviations);
  EXPECT_EQ(file.highest_above_plane, code.highest_above_plane);
  EXPECT_EQ(file.cluster_tolerance, code.cluster_tolerance);
  EXPECT_EQ(file.cluster_min_area, code.cluster_min_area);
  EXPECT_EQ(file.asked_distance, code.asked_distance);
  EXPECT_EQ(file.outlier_voxel, code.outlier_voxel);
  EXPECT_EQ(file.outlier_neighbours, code.outlier_neighbours);
  EXPECT_EQ(file.outlier_deviations, code.outlier_deviations);
  EXPECT_EQ(file.smoothing_radius, code.smoothing_radius);
  EXPECT_EQ(file.smoothing_voxel, code.smoothing_voxel);
  EXPECT_EQ(file.centroid_voxel, code.centroid_voxel);
  EXPECT_EQ(file.handle_samples, code.handle_samples);
  EXPECT_EQ(file.handle_neighbourhood, code.handle_neighbourhood);
  EXPECT_EQ(file.handle_min_radius, code.handle_min_radius);
  EXPECT_EQ(file.handle_max_radius, code.handle_max_radius);
  EXPECT_EQ(file.handle_gap, code.handle_gap);
  EXPECT_EQ(file.handle_min_inliers, code.handle_min_inliers);
  EXPECT_EQ(file.handle_align_angle, code.handle_align_angle);
  EXPECT_EQ(file.handle_align_distance, code.handle_align_distance);
  EXPECT_EQ(file.handle_align_radius, code.handle_align_radius);
  EXPECT_EQ(file.seed, code.seed);
  EXPECT_EQ(file.threads, code.threads);
  EXPECT_EQ(YAML::LoadFile(shipped.string())["stage_one"].size(), 30U);
}

TEST(ParameterDefaults, ShippedFileHoldsEveryKeyOfStageTwoAtItsDefault) {
  const fs::path shipped = fs::path(WALKMAN_SOURCE_TREE) / "adaptation/parameters.yaml";
  const StageTwoParameters file = load_method_parameters(shipped).stage_two, code;
  EXPECT_EQ(file.torque_threshold, code.torque_threshold);
  EXPECT_EQ(file.displacement_threshold, code.displacement_threshold);
  EXPECT_EQ(file.average_time, code.average_time);
  EXPECT_EQ(file.max_regrasps, code.max_regrasps);
  EXPECT_EQ(file.tare_time, code.tare_time);
  EXPECT_EQ(file.pose_time, code.pose_time);
  EXPECT_EQ(file.rest_speed, code.rest_speed);
  EXPECT_EQ(file.rest_time, code.rest_time);
  EXPECT_EQ(file.rest_timeout, code.rest_timeout);
  EXPECT_EQ(file.sensor_gain, code.sensor_gain);
  EXPECT_EQ(file.sensor_axial_gain, code.sensor_axial_gain);
  EXPECT_EQ(file.sensor_cross_talk, code.sensor_cross_talk);
  EXPECT_EQ(file.sensor_force_per_torque, code.sensor_force_per_torque);
  EXPECT_EQ(file.sensor_torque_per_force, code.sensor_torque_per_force);
  EXPECT_EQ(file.sensor_force_range, code.sensor_force_range);
  EXPECT_EQ(file.sensor_torque_range, code.sensor_torque_range);
  EXPECT_EQ(file.calibration_turn, code.calibration_turn);
  EXPECT_EQ(file.weighing_turn, code.weighing_turn);
  EXPECT_EQ(file.approach_height, code.approach_height);
  EXPECT_EQ(file.approach_back, code.approach_back);
  EXPECT_EQ(file.palm_clearance, code.palm_clearance);
  EXPECT_EQ(file.lift_height, code.lift_height);
  EXPECT_EQ(file.lift_step, code.lift_step);
  EXPECT_EQ(file.lift_max, code.lift_max);
  EXPECT_EQ(file.lift_force_change, code.lift_force_change);
  EXPECT_EQ(file.payload_time, code.payload_time);
  EXPECT_EQ(file.lift_window, code.lift_window);
  EXPECT_EQ(file.min_force, code.min_force);
  EXPECT_EQ(file.watch_time, code.watch_time);
  EXPECT_EQ(file.force_slope, code.force_slope);
  EXPECT_EQ(file.torque_slope, code.torque_slope);
  EXPECT_EQ(file.force_drift, code.force_drift);
  EXPECT_EQ(file.torque_drift, code.torque_drift);
  EXPECT_EQ(file.close_time, code.close_time);
  EXPECT_EQ(file.hold_time, code.hold_time);
  EXPECT_EQ(file.grip_torque, code.grip_torque);
  EXPECT_EQ(file.touch_force, code.touch_force);
  EXPECT_EQ(file.empty_closure, code.empty_closure);
  EXPECT_EQ(file.travel_speed, code.travel_speed);
  EXPECT_EQ(file.approach_speed, code.approach_speed);
  EXPECT_EQ(file.lift_speed, code.lift_speed);
  EXPECT_EQ(file.angular_speed, code.angular_speed);
  EXPECT_EQ(file.carry_time, code.carry_time);
  EXPECT_EQ(file.hanging_turn, code.hanging_turn);
  EXPECT_EQ(file.hanging_roll, code.hanging_roll);
  EXPECT_EQ(file.max_looks, code.max_looks);
  EXPECT_EQ(YAML::LoadFile(shipped.string())["stage_two"].size(), 46U);
}

TEST(ParameterDefaults, AreThePapersWhereItGivesThem) {
  const StageOneParameters one;
  EXPECT_EQ(one.reach, 1.5);
  EXPECT_GE(one.handle_neighbourhood, 0.02);
  EXPECT_LE(one.handle_neighbourhood, 0.03);
  const StageTwoParameters two;
  EXPECT_EQ(two.torque_threshold, 0.02);
  EXPECT_EQ(two.displacement_threshold, 0.02);
  EXPECT_EQ(two.average_time, 2);
}

TEST_F(ParameterFile, UnknownKeysAreNamedWithFileLineAndSection) {
  const std::string name = file_.filename().string();
  EXPECT_THAT(error("stage_one:\n  reach: 1.5\n\n  handle_sample: 3\n"),
              HasSubstr(name + ":4: stage_one.handle_sample: unknown key; did you mean \"handle_samples\"?"));
  EXPECT_THAT(stage_two_error("lift_hieght: 0.1"),
              HasSubstr(name + ":2: stage_two.lift_hieght: unknown key"));
  EXPECT_THAT(error("stage_one:\n  reach: 1\nstage_three:\n  x: 1\n"),
              HasSubstr(name + ":3: stage_three: unknown key"));
  EXPECT_THAT(error("reach: 1\n"), HasSubstr(":1: reach: unknown key, expected one of stage_one, stage_two"));
}

TEST_F(ParameterFile, BadValuesAreNamedWithWhatWasExpected) {
  EXPECT_THAT(stage_one_error("reach: far"), HasSubstr(":2: stage_one.reach: \"far\" is not a number"));
  EXPECT_THAT(stage_one_error("reach: -1"), HasSubstr("found -1, expected more than 0 and at most 100"));
  EXPECT_THAT(stage_one_error("reach: 0"), HasSubstr("found 0, expected more than 0"));
  EXPECT_THAT(stage_one_error("reach: 101"), HasSubstr("found 101, expected more than 0 and at most 100"));
  EXPECT_THAT(stage_one_error("plane_min_share: 1.01"), HasSubstr("at most 1"));
  EXPECT_THAT(stage_one_error("reach: .nan"), HasSubstr("\".nan\" is not a number"));
  EXPECT_THAT(stage_one_error("reach: nan"), HasSubstr("\"nan\" is not finite"));
  EXPECT_THAT(stage_one_error("reach: [1]"), HasSubstr("found a list of 1, expected a number"));
  EXPECT_THAT(stage_one_error("threads: 0"),
              HasSubstr("found \"0\", expected a whole number from 1 to 1024"));
  EXPECT_THAT(stage_one_error("handle_samples: 2.5"), HasSubstr("found \"2.5\", expected a whole number"));
  EXPECT_THAT(stage_one_error("seed: -1"), HasSubstr("found \"-1\", expected a whole number from 0"));
  EXPECT_THAT(stage_one_error("handle_min_radius: 0.06"),
              HasSubstr(":2: stage_one.handle_min_radius: found 0.06, expected less than handle_max_radius"));
  EXPECT_THAT(stage_two_error("lift_height: -1"),
              HasSubstr(":2: stage_two.lift_height: found -1, expected 0 to 1"));
  EXPECT_THAT(stage_two_error("rest_time: 1e9"), HasSubstr("expected 0.02 to 60"));
  EXPECT_THAT(stage_two_error("average_time: 0"), HasSubstr("found 0, expected 0.02 to 60"));
  EXPECT_THAT(stage_two_error("lift_speed: .nan"),
              HasSubstr("stage_two.lift_speed: \".nan\" is not a number"));
  EXPECT_THAT(stage_two_error("max_regrasps: 1.5"), HasSubstr("found \"1.5\", expected a whole number"));
}

TEST_F(ParameterFile, RepeatedKeysAndOtherDocumentsAreErrors) {
  EXPECT_THAT(error("stage_one:\n  reach: 1\n  reach: 2\n"),
              AllOf(HasSubstr(":3"), HasSubstr("the key appears twice")));
  EXPECT_THAT(error("- 1\n- 2\n"),
              HasSubstr("found a list of 2, expected a mapping of stage_one, stage_two"));
  EXPECT_THAT(error("stage_two: 3\n"), HasSubstr("stage_two: found \"3\", expected a mapping"));
  EXPECT_THAT(error("stage_one:\n  reach: [1\n"), HasSubstr("not well-formed YAML"));
  EXPECT_THAT(error(""), HasSubstr("the file is empty"));
  EXPECT_THROW(static_cast<void>(load_method_parameters("/nonexistent/parameters.yaml")), std::runtime_error);
}

}  // namespace
}  // namespace walkman
