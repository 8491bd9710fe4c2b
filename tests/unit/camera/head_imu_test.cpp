// The head's inertial unit through the camera's protocol, against its expected readings in closed form.

#include "emulator/camera/head_imu.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/camera/multisense/datagram.h"

namespace walkman {
namespace {

using namespace std::chrono_literals;
using multisense::ImuConfig, multisense::ImuData, multisense::ImuInfo, multisense::ImuKind;
using ::testing::ElementsAre;

constexpr double kDegree = std::numbers::pi / 180;

plant::InertialMotion turning(const Eigen::Vector3d& rate) {
  plant::InertialMotion motion;
  motion.specific_force_S = Eigen::Vector3d(0, 0, 9.80665);
  motion.angular_velocity_S = rate;
  return motion;
}

std::vector<multisense::ImuSample> samples_of(HeadImu& imu, const plant::InertialMotion& motion, Time from,
                                              Time to) {
  std::vector<multisense::ImuSample> all;
  ImuData data;
  for (Time now = from; now < to; now += 1ms) {
    imu.advance(now, motion);
    while (imu.take(now, data)) all.insert(all.end(), data.samples.begin(), data.samples.end());
  }
  return all;
}

TEST(HeadImu, ReadsGravityTurnAndFieldInTheUnitsAndAxesOfItsChips) {
  HeadImu imu({0, 0, 0, 0, 0, 0}, 1);
  const auto samples = samples_of(imu, turning({10 * kDegree, 20 * kDegree, 30 * kDegree}), 0ms, 1000ms);
  std::array<int, 3> count{};
  for (const auto& sample : samples) {
    ++count[static_cast<std::size_t>(sample.kind) - 1];
    if (sample.nanoseconds < 500'000'000) continue;
    switch (sample.kind) {
      case ImuKind::kAccelerometer:
        EXPECT_THAT(sample.value, ElementsAre(0, 0, testing::FloatNear(1, 0.0006F)));
        break;
      case ImuKind::kGyroscope:  // in the accelerometer's axes the rate is (y, −x, z) of this reading
        EXPECT_THAT(sample.value, ElementsAre(testing::FloatNear(-20, 0.005F), testing::FloatNear(10, 0.005F),
                                              testing::FloatNear(30, 0.005F)));
        break;
      case ImuKind::kMagnetometer:
        EXPECT_NEAR(std::hypot(sample.value[0], sample.value[1], sample.value[2]), 0.47, 0.01);
        EXPECT_LT(sample.value[2], -0.4F);  // down, north of the equator
    }
  }
  EXPECT_NEAR(count[0], 200, 12);
  EXPECT_NEAR(count[1], 200, 12);
  EXPECT_NEAR(count[2], 100, 12);
}

TEST(HeadImu, HasTheNoiseThatItsDensityGivesWithinItsBand) {
  ImuErrors errors{0, 0, 0.03, 0, 0, 0};
  HeadImu imu(errors, 1);
  double squares = 0;
  int count = 0;
  for (const auto& sample : samples_of(imu, turning({0, 0, 0}), 0ms, 20000ms)) {
    if (sample.kind != ImuKind::kGyroscope) continue;
    for (const float value : sample.value) squares += std::pow(static_cast<double>(value), 2);
    count += 3;
  }
  // First order: the noise bandwidth is π/2 times the 13 Hz.
  EXPECT_NEAR(std::sqrt(squares / count), 0.03 * std::sqrt(13 * std::numbers::pi / 2), 0.005);
}

TEST(HeadImu, IsSetToWhatItOffersAndNothingElse) {
  HeadImu imu({0, 0, 0, 0, 0, 0}, 1);
  ImuConfig wanted;
  wanted.samples_per_message = 10;
  wanted.sensors = {{"accelerometer", ImuConfig::kEnabled, 2, 1}, {"gyroscope", 0, 0, 0}};
  EXPECT_TRUE(imu.set(wanted));
  EXPECT_EQ(imu.config().samples_per_message, 10U);
  EXPECT_EQ(imu.config().sensors[0].rate, 2U);
  int fast = 0;
  for (const auto& sample : samples_of(imu, turning({0, 0, 0}), 0ms, 1000ms)) {
    EXPECT_NE(sample.kind, ImuKind::kGyroscope);
    fast += sample.kind == ImuKind::kAccelerometer ? 1 : 0;
  }
  EXPECT_NEAR(fast, 50, 8);
  for (const auto& bad :
       {ImuConfig::Sensor{"accelerometer", 1, 7, 0}, ImuConfig::Sensor{"accelerometer", 1, 0, 4},
        ImuConfig::Sensor{"thermometer", 1, 0, 0}}) {
    wanted.sensors = {bad};
    EXPECT_FALSE(imu.set(wanted));
  }
  wanted.sensors.clear();
  wanted.samples_per_message = 301;
  EXPECT_FALSE(imu.set(wanted));
  EXPECT_EQ(imu.config().samples_per_message, 10U);
}

// Sizes counted by hand: a sample of version 1 has 22 bytes, the prefix of a list 6.
TEST(HeadImu, ItsMessagesAreThoseOfTheVendor) {
  ImuData data{7, {{ImuKind::kGyroscope, 5, {1, 2, 3}}, {}}};
  const std::vector<std::uint8_t> bytes = multisense::encode(data);
  EXPECT_EQ(bytes.size(), 4U + 4 + 6 + 2 * 22);
  EXPECT_THAT(std::vector(bytes.begin(), bytes.begin() + 16),
              ElementsAre(0x14, 0x01, 1, 0, 7, 0, 0, 0, 1, 0, 2, 0, 0, 0, 2, 0));
  const auto back = multisense::decode<ImuData>(bytes);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->samples[0].value[2], 3);
  const auto info = multisense::decode<ImuInfo>(multisense::encode(HeadImu::info()));
  ASSERT_TRUE(info);
  EXPECT_EQ(info->sensors[1].ranges[2].first, 2000);
  const ImuConfig config = HeadImu({0, 0, 0, 0, 0, 0}, 1).config();
  EXPECT_EQ(multisense::decode<ImuConfig>(multisense::encode(config))->sensors[2].name, "magnetometer");
  std::vector<std::uint8_t> endless = bytes;
  endless[10] = endless[11] = endless[12] = 0xFF;
  EXPECT_FALSE(multisense::decode<ImuData>(endless));
}

}  // namespace
}  // namespace walkman
