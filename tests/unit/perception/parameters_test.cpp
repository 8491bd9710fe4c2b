#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "adaptation/perception/stage_one.h"

namespace walkman::perception {
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

  [[nodiscard]] StageOneParameters load(const std::string& text) const {
    std::ofstream(file_) << text;
    return load_stage_one_parameters(file_);
  }
  [[nodiscard]] std::string error(const std::string& text) const {
    try {
      static_cast<void>(load(text));
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "none";
  }

  fs::path file_;
};

TEST_F(ParameterFile, GivenKeysReplaceDefaults) {
  const auto p = load("reach: 1.2\nhandle_samples: 500\nseed: 9\n");
  EXPECT_DOUBLE_EQ(p.reach, 1.2);
  EXPECT_EQ(p.handle_samples, 500);
  EXPECT_EQ(p.seed, 9U);
  EXPECT_DOUBLE_EQ(p.handle_gap, StageOneParameters{}.handle_gap);
  EXPECT_DOUBLE_EQ(load("").reach, 1.5);
}

TEST(ParameterDefaults, ShippedFileHoldsEveryKeyAtItsDefault) {
  const fs::path shipped = fs::path(WALKMAN_TEST_DATA) / "../../adaptation/parameters.yaml";
  const StageOneParameters file = load_stage_one_parameters(shipped), code;
  EXPECT_EQ(file.reach, code.reach);
  EXPECT_EQ(file.plane_distance, code.plane_distance);
  EXPECT_EQ(file.plane_normal_angle, code.plane_normal_angle);
  EXPECT_EQ(file.plane_iterations, code.plane_iterations);
  EXPECT_EQ(file.plane_min_share, code.plane_min_share);
  EXPECT_EQ(file.above_plane, code.above_plane);
  EXPECT_EQ(file.highest_above_plane, code.highest_above_plane);
  EXPECT_EQ(file.cluster_tolerance, code.cluster_tolerance);
  EXPECT_EQ(file.cluster_min_points, code.cluster_min_points);
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
  EXPECT_EQ(YAML::LoadFile(shipped.string())["stage_one"].size(), 26U);
}

TEST_F(ParameterFile, SectionOfBothStagesFileIsTaken) {
  EXPECT_DOUBLE_EQ(load("stage_one:\n  reach: 1.1\nstage_two:\n  lift_height: 0.2\n").reach, 1.1);
  EXPECT_THAT(error("stage_one:\n  raech: 1.1\n"), HasSubstr(":2: unknown key 'raech'"));
}

TEST_F(ParameterFile, UnknownKeyNamesFileLineAndKey) {
  EXPECT_THAT(error("reach: 1.5\n\nhandle_sample: 3\n"),
              AllOf(HasSubstr(file_.filename().string() + ":3"), HasSubstr("unknown key 'handle_sample'")));
}

TEST_F(ParameterFile, BadValuesNameWhatWasFound) {
  EXPECT_THAT(error("reach: far\n"), AllOf(HasSubstr(":1: reach"), HasSubstr("'far'")));
  EXPECT_THAT(error("reach: -1\n"), HasSubstr("'-1'"));
  EXPECT_THAT(error("reach: .nan\n"), HasSubstr("'.nan'"));
  EXPECT_THAT(error("reach: [1]\n"), HasSubstr("no single value"));
  EXPECT_THAT(error("threads: 0\n"), HasSubstr("an integer from 1"));
  EXPECT_THAT(error("handle_samples: 2.5\n"), HasSubstr("'2.5'"));
  EXPECT_THAT(error("handle_min_radius: 0.06\n"), HasSubstr("is not below"));
}

TEST_F(ParameterFile, RepeatedKeysAndOtherDocumentsAreErrors) {
  EXPECT_THAT(error("reach: 1\nreach: 2\n"), AllOf(HasSubstr(":2"), HasSubstr("given twice")));
  EXPECT_THAT(error("- 1\n- 2\n"), HasSubstr("no map"));
  EXPECT_THAT(error("reach: [1\n"), HasSubstr("not YAML"));
  EXPECT_THROW(static_cast<void>(load_stage_one_parameters("/nonexistent/stage_one.yaml")),
               std::runtime_error);
}

}  // namespace
}  // namespace walkman::perception
