#include "emulator/nodes/measuring/force_torque_kind.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "adaptation/parameters.h"

namespace walkman {
namespace {

using nodes::Matrix6;
using nodes::Vector6;
using testing::HasSubstr;

const std::filesystem::path kShipped =
    std::filesystem::path(WALKMAN_URDF_DIR) / "../emulator/nodes/measuring/force_torque_45mm.yaml";

/// Returns the error message of loading the shipped file with `from` replaced by `to`; empty if it loads.
std::string message_of(const std::string& from, const std::string& to) {
  std::stringstream text;
  text << std::ifstream(kShipped).rdbuf();
  std::string changed = text.str();
  const std::size_t at = changed.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  changed.replace(at, from.size(), to);
  const std::filesystem::path file =
      std::filesystem::path(testing::TempDir()) / "force_torque_kind_test.yaml";
  std::ofstream(file) << changed;
  try {
    static_cast<void>(load_force_torque_kind(file));
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "";
}

TEST(ForceTorqueKind, ShippedFileHasTheRatingsOfTheFortyFiveMillimetreSensor) {
  const ForceTorqueKind kind = load_force_torque_kind(kShipped);
  EXPECT_EQ(kind.force_range, Eigen::Vector3d(1500, 1500, 2000));
  EXPECT_EQ(kind.torque_range, Eigen::Vector3d(35, 35, 25));
  EXPECT_EQ(kind.force_resolution, Eigen::Vector3d::Constant(0.25));
  EXPECT_EQ(kind.torque_resolution, Eigen::Vector3d(0.005, 0.005, 0.004));
}

/// Accuracy of ME-Messsysteme's six-axis sensors: about 1 % of the rated load of the other axes.
TEST(ForceTorqueKind, ShippedFilesHaveTheCrossTalkOfADataSheet) {
  EXPECT_EQ(load_force_torque_kind(kShipped).cross_talk, 0.01);
  EXPECT_EQ(load_force_torque_kind(kShipped.parent_path() / "force_torque_ankle.yaml").cross_talk, 0.01);
}

/// The two sides read different files: the sensor data assumed by the robot's computer, and the emulated
/// data.
TEST(ForceTorqueKind, TheMethodTakesTheSensorForWhatItIs) {
  const ForceTorqueKind kind = load_force_torque_kind(kShipped);
  const auto method =
      load_method_parameters(std::filesystem::path(WALKMAN_SOURCE_TREE) / "adaptation/parameters.yaml");
  EXPECT_EQ(method.stage_two.sensor_cross_talk, kind.cross_talk);
  EXPECT_EQ(method.stage_two.sensor_force_range, kind.force_range.x());
  EXPECT_EQ(method.stage_two.sensor_torque_range, kind.torque_range.x());
}

TEST(ForceTorqueKind, BadFilesAreRefusedWithFileLineAndKey) {
  EXPECT_THAT(message_of("force_range: [1500, 1500, 2000]", "force_range: [1500, 1500]"),
              testing::AllOf(HasSubstr("force_torque_kind_test.yaml:4"), HasSubstr("force_range")));
  EXPECT_THAT(message_of("torque_range: [35, 35, 25]", "torque_range: [35, -35, 25]"),
              HasSubstr("more than 0"));
  EXPECT_THAT(message_of("[0.25, 0.25, 0.25]", "[0.25, 0.25, 2000]"), HasSubstr("less than force_range"));
  EXPECT_THAT(message_of("noise: 1.0", "noise: -1"), HasSubstr("noise"));
  EXPECT_THAT(message_of("noise: 1.0", "noise: .nan"), HasSubstr("noise"));
  EXPECT_THAT(message_of("noise: 1.0", "nois: 1.0"), HasSubstr("nois"));
  EXPECT_THAT(message_of("noise: 1.0", "# noise"), HasSubstr("noise"));
  EXPECT_THAT(message_of("cross_talk: 0.01", "cross_talk: 0.5"), HasSubstr("0.2"));
  EXPECT_THAT(message_of("warm_up_time: 900", "warm_up_time: 0"), HasSubstr("more than 0"));
  EXPECT_THAT(message_of("ambient: 25", "ambient: -300"), HasSubstr("ambient"));
  EXPECT_EQ(message_of("noise: 1.0", "noise: 0"), "");
  EXPECT_THROW(static_cast<void>(load_force_torque_kind("/no/such/file.yaml")), std::runtime_error);
}

TEST(ForceTorqueKind, ASensorsOwnValuesFillTheirBoundsAndDifferBySensorAndSeed) {
  const ForceTorqueKind kind = load_force_torque_kind(kShipped);
  Vector6 range, bias, drift;
  range << kind.force_range, kind.torque_range;
  bias << Vector6::Constant(kind.force_bias).head<3>(), Vector6::Constant(kind.torque_bias).tail<3>();
  drift = kind.drift * range;
  double largest_bias = 0, largest_drift = 0, largest_cross = 0;  // as fractions of their bounds
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const auto t = draw_sensor(kind, SensorErrors::kAll, seed, 18).transducer;
    largest_bias = std::max(largest_bias, t.bias.cwiseQuotient(bias).cwiseAbs().maxCoeff());
    largest_drift = std::max(largest_drift, t.drift_per_kelvin.cwiseQuotient(drift).cwiseAbs().maxCoeff());
    const Matrix6 cross =
        range.cwiseInverse().asDiagonal() * (t.cross_talk - Matrix6::Identity()) * range.asDiagonal();
    largest_cross = std::max(largest_cross, cross.cwiseAbs().maxCoeff() / kind.cross_talk);
    EXPECT_NE(t.bias, draw_sensor(kind, SensorErrors::kAll, seed, 28).transducer.bias);
    EXPECT_NE(t.bias, draw_sensor(kind, SensorErrors::kAll, seed + 1, 18).transducer.bias);
    EXPECT_EQ(t.cross_talk, draw_sensor(kind, SensorErrors::kAll, seed, 18).transducer.cross_talk);
  }
  for (const double share : {largest_bias, largest_drift, largest_cross}) {
    EXPECT_GT(share, 0.95);
    EXPECT_LE(share, 1 + 1e-9);
  }
}

TEST(ForceTorqueKind, ErrorsAreSwitchedOffInTwoSteps) {
  const ForceTorqueKind kind = load_force_torque_kind(kShipped);
  Wrench load;
  load.force = {12.3456789, -2, 4000};
  load.torque = {0.001234, 50, -3};
  Vector6 truth;
  truth << load.force, load.torque;
  const auto none = draw_sensor(kind, SensorErrors::kNone, 1, 18);
  nodes::ForceTorqueTransducer ideal(none.transducer, 1e-3);
  EXPECT_EQ(ideal.measure(load), truth);
  EXPECT_EQ(none.channels[0].resolution, 0);
  EXPECT_TRUE(std::isinf(none.channels[2].range));

  const auto noisy = draw_sensor(kind, SensorErrors::kNoiseAndResolution, 1, 18);
  nodes::ForceTorqueTransducer transducer(noisy.transducer, 1e-3);
  Vector6 sum = Vector6::Zero();
  constexpr int kSamples = 10000;
  for (int i = 0; i < kSamples; ++i) sum += transducer.measure(load);
  EXPECT_LT((sum / kSamples - truth).cwiseQuotient(noisy.transducer.noise).cwiseAbs().maxCoeff(), 0.05);
  EXPECT_EQ(noisy.channels[0].resolution, 0.25);
  EXPECT_EQ(noisy.channels[2].range, 2000);
}

TEST(ForceTorqueKind, ZeroOfTheShippedSensorDriftsByLittleInTheFirstMinute) {
  const ForceTorqueKind kind = load_force_torque_kind(kShipped);
  auto t = draw_sensor(kind, SensorErrors::kAll, 1, 18).transducer;
  t.noise.setZero();
  nodes::ForceTorqueTransducer transducer(t, 1e-3);
  const Vector6 before = transducer.measure({});
  for (int i = 0; i < 60000; ++i) static_cast<void>(transducer.measure({}));
  const Vector6 moved = (transducer.measure({}) - before).cwiseAbs();
  // Rise in a minute: 6 K (1 - exp(-60 s / 900 s)) = 0.387 K.
  EXPECT_NEAR(transducer.temperature_c(), 25.387, 1e-3);
  EXPECT_GT(moved.maxCoeff(), 0.005);             // N: it does drift,
  EXPECT_LT(moved.head<3>().maxCoeff(), 0.08);    // within 0.01 % of 2000 N per kelvin,
  EXPECT_LT(moved.tail<3>().maxCoeff(), 0.0014);  // and of 35 N·m
}

}  // namespace
}  // namespace walkman
