// Against frames counted by hand: bits according to ISO 11898-1, the five buses of the robot.

#include "drivers/robot/bus_load.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/can/frame_time.h"
#include "urdf/reader/robot_model.h"

namespace walkman::robot {
namespace {

using std::chrono::microseconds;

TEST(WorstFrameTime, ClassicalFramesAtOneMegabit) {
  const std::array<int, 9> bits = {55, 65, 75, 85, 95, 105, 115, 125, 135};
  for (std::size_t n = 0; n < bits.size(); ++n) {
    EXPECT_EQ(can::worst_frame_time(n, {1'000'000, 5'000'000}), microseconds(bits[n])) << n;
  }
  EXPECT_EQ(can::worst_frame_time(8, {125'000, 5'000'000}), microseconds(8 * 135));
}

TEST(WorstFrameTime, FdFramesSwitchTheBitRate) {
  const auto us = [](std::size_t bytes, std::uint32_t data_rate) {
    return static_cast<double>(can::worst_frame_time(bytes, {1'000'000, data_rate}).count()) / 1000;
  };
  EXPECT_NEAR(us(16, 5'000'000), 71.8, 0.05);
  EXPECT_NEAR(us(24, 5'000'000), 88.8, 0.05);
  EXPECT_NEAR(us(32, 5'000'000), 104.8, 0.05);
  EXPECT_NEAR(us(64, 5'000'000), 168.8, 0.05);
  EXPECT_NEAR(us(16, 8'000'000), 57.2, 0.05);
  EXPECT_NEAR(us(64, 8'000'000), 117.9, 0.1);
  EXPECT_EQ(us(17, 5'000'000), us(20, 5'000'000));
}

class RobotsBuses : public ::testing::Test {
 protected:
  const RobotModel model_ = load_robot_model(std::string(WALKMAN_URDF_DIR) + "/walkman.urdf");
  const DeviceTable table_ =
      load_device_table(std::string(WALKMAN_URDF_DIR) + "/walkman.devices.yaml", model_);
  [[nodiscard]] BusLoad of(const std::string& bus, Time cycle) const {
    for (const BusLoad& load : bus_loads(table_, factory_layout(), cycle, std::chrono::milliseconds(100))) {
      if (load.bus == bus) return load;
    }
    throw std::runtime_error("no bus " + bus);
  }
};

TEST_F(RobotsBuses, AnArmInLayoutACarries80To85PercentAt200Hz) {
  const BusLoad arm = of("rarm", microseconds(5000));
  // SYNC, 8 drives with two PDOs of 5 and two of 8 bytes, sensor with 8 and 7 bytes.
  EXPECT_EQ(arm.frames, 1 + 8 * 4 + 2);
  EXPECT_EQ(arm.cyclic, microseconds(55 + 8 * (2 * 105 + 2 * 135) + 135 + 125));
  EXPECT_GT(arm.load, 0.80);
  EXPECT_LT(arm.with_events, 0.85);
  EXPECT_EQ(arm.highest_rate_hz, 240);
}

TEST_F(RobotsBuses, ALegHasRoom) {
  const BusLoad leg = of("lleg", microseconds(5000));
  EXPECT_EQ(leg.frames, 27);
  EXPECT_EQ(leg.cyclic, microseconds(3195));
}

TEST_F(RobotsBuses, OneKilohertzIsRefusedInOneSentence) {
  EXPECT_NO_THROW(require_capacity(table_, factory_layout(), microseconds(5000)));
  try {
    require_capacity(table_, factory_layout(), microseconds(1000));
    FAIL() << "accepted";
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(), ::testing::HasSubstr("overload"));
    EXPECT_THAT(e.what(), ::testing::HasSubstr("Hz"));
  }
}

}  // namespace
}  // namespace walkman::robot
