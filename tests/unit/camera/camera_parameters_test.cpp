#include "emulator/camera/camera_parameters.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace walkman {
namespace {

using ::testing::HasSubstr;

const std::filesystem::path kFile =
    std::filesystem::path(WALKMAN_SOURCE_TREE) / "emulator/camera/multisense.yaml";

/// Returns the error message for the file with `from` replaced by `to`.
std::string problem_with(const std::string& from, const std::string& to) {
  std::stringstream text;
  text << std::ifstream(kFile).rdbuf();
  std::string changed = text.str();
  const std::size_t at = changed.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  changed.replace(at, from.size(), to);
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "camera_parameters.yaml";
  std::ofstream(file) << changed;
  try {
    static_cast<void>(load_camera_parameters(file));
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "none";
}

// Against the values published in the calibration file and the data sheets.
TEST(CameraParameters, AreThoseOfTheSensor) {
  const CameraParameters parameters = load_camera_parameters(kFile);
  EXPECT_NEAR(parameters.stereo.focal_px * 2, 1177.54, 0.1);
  EXPECT_NEAR(parameters.stereo.baseline, 82.5098 / 1177.54, 1e-4);
  EXPECT_EQ(parameters.stereo.disparity_step, 1.0 / 16);
  EXPECT_EQ(parameters.rate_hz, 15);
  EXPECT_EQ(parameters.laser.beams, 1081);
  EXPECT_NEAR(parameters.laser.step * 1080 * 180 / M_PI, 270, 1e-9);
  EXPECT_NEAR(parameters.laser.beam_period * 1080, 0.01875, 1e-12);
  const CameraParameters ideal = parameters.noise_free();
  EXPECT_EQ(ideal.stereo.sigma_d + ideal.stereo.locking + ideal.stereo.spike_fraction +
                ideal.stereo.dropout_fraction,
            0);
  EXPECT_EQ(ideal.laser.noise + ideal.laser.noise_far + ideal.laser.noise_grazing + ideal.laser.bias, 0);
}

TEST(CameraParameters, OfAFileThatIsWrongAreRefusedWithItsLine) {
  EXPECT_THAT(problem_with("sigma_d_px: 0.2", "sigma_d_px: -1"), HasSubstr("sigma_d_px"));
  EXPECT_THAT(problem_with("sigma_d_px: 0.2", "sigma_d: 0.2"), HasSubstr("camera_parameters.yaml:"));
  EXPECT_THAT(problem_with("beams: 1081", "beams: many"), HasSubstr("beams"));
  EXPECT_THAT(problem_with("most_range_m: 30 ", "most_range_m: 0.05 "), HasSubstr("most_range_m"));
  EXPECT_THAT(problem_with("laser:", "lidar:"), HasSubstr("lidar"));
  EXPECT_THAT(problem_with("beams: 1081", "beams: 1082"), HasSubstr("beams"));
  EXPECT_EQ(problem_with("rate_hz: 15", "rate_hz: 10"), "none");
}

}  // namespace
}  // namespace walkman
