// Faults visible in the feedback, each with its code in 603Fh and in EMCY.

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/nodes/joint_rig.h"

namespace walkman::nodes {
namespace {

using cia402::State;
using testing::Contains;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct DriveSupervisionTest : JointRig {
  void push(const ServoFeedback& feedback, int steps = 1) {
    for (int i = 0; i < steps; ++i) torque = node.control(feedback, kStep);
  }
  Frames heard() { return talk.listen(milliseconds(2)); }
  /// Resets by the edge; returns true if the drive has left the fault state.
  bool reset() {
    control(0x00);
    control(0x80);
    return node.state() == State::kSwitchOnDisabled;
  }
  ServoFeedback f;
};

TEST_F(DriveSupervisionTest, TemperaturesWarnAndTrip) {
  f.board_temperature_c = 80;
  push(f);
  EXPECT_EQ(status() & 0x80U, 0x80U);
  f.board_temperature_c = 100;
  push(f);
  EXPECT_THAT(heard(), Contains("085#1042090000000000"));
  EXPECT_FALSE(reset());
  f.board_temperature_c = 99;
  push(f);
  EXPECT_TRUE(reset());
  write(0x2030, 4, 950, 2);  // the limit drops below the temperature
  push(f);
  EXPECT_EQ(read(0x603F), 0x4210U);
  EXPECT_EQ(read_signed(0x2030, 2), 990);
}

TEST_F(DriveSupervisionTest, OverVoltage) {
  f.supply_voltage = 60.5;
  push(f);
  EXPECT_THAT(heard(), Contains("085#1032050000000000"));
  EXPECT_EQ(read(0x6079), 60'500U);
  EXPECT_FALSE(reset());
  write(0x2032, 2, 70'000, 4);
  push(f);
  EXPECT_TRUE(reset());
}

TEST_F(DriveSupervisionTest, UnderVoltageIsAFaultWhileTheSupplyIsNeeded) {
  f.supply_voltage = 20;
  push(f);
  EXPECT_EQ(node.state(), State::kSwitchOnDisabled);
  EXPECT_EQ(status(), 0x0240U);  // bit 4: no voltage
  control(0x06);
  push(f);
  EXPECT_EQ(node.state(), State::kReadyToSwitchOn);
  control(0x07);
  push(f);
  EXPECT_EQ(node.state(), State::kFault);
  EXPECT_THAT(heard(), Contains("085#2032050000000000"));
  f.supply_voltage = 48;
  push(f);
  EXPECT_EQ(status(), 0x0218U);
  EXPECT_TRUE(reset());
  enable();
  push(f);
  f.supply_voltage = 30;
  push(f, 2);
  EXPECT_EQ(read(0x603F), 0x3220U);
}

TEST_F(DriveSupervisionTest, ReadingsThatAreNoNumbers) {
  for (const auto& [member, code] :
       {std::pair{&ServoFeedback::motor_position, 0x7305U},
        std::pair{&ServoFeedback::motor_velocity, 0x7305U}, std::pair{&ServoFeedback::link_position, 0x7306U},
        std::pair{&ServoFeedback::link_velocity, 0x7306U}}) {
    for (const double value : {kNan, std::numeric_limits<double>::infinity()}) {
      f = ServoFeedback{};
      f.motor_position = f.link_position = 0.25;
      push(f);
      enable();
      push(f, 2);
      ASSERT_EQ(node.state(), State::kOperationEnabled);
      f.*member = value;
      f.spring_torque = value;
      push(f);
      EXPECT_EQ(node.state(), State::kFault);  // its loops cannot brake it
      EXPECT_EQ(torque, 0);
      EXPECT_EQ(read(0x603F), code);
      EXPECT_EQ(read(0x6064), 250'000U);  // the last valid reading
      EXPECT_FALSE(reset());
      f = ServoFeedback{};
      f.motor_position = f.link_position = 0.25;
      push(f);
      EXPECT_TRUE(reset());
    }
  }
}

// 3 x 150 N·m / 1300 N·m/rad + 0.05 rad = 0.396 rad between the encoders is impossible.
TEST_F(DriveSupervisionTest, AFrozenEncoderIsFoundByTheOtherOne) {
  push(f);
  for (int i = 1; i <= 400; ++i) {
    f.link_position = i * 1e-3;
    push(f);
    if (i < 390) {
      ASSERT_NE(node.state(), State::kFault) << i;
    }
  }
  EXPECT_EQ(read(0x603F), 0x7305U);  // the motor encoder has not changed
  EXPECT_FALSE(reset());
  f.motor_position = f.link_position;
  push(f);
  EXPECT_TRUE(reset());
  for (int i = 1; i <= 400; ++i) {
    f.motor_position -= 1e-3;
    push(f);
  }
  EXPECT_EQ(read(0x603F), 0x7306U);
}

TEST_F(DriveSupervisionTest, AJumpingEncoderIsFound) {
  const auto wobble = [&](int i) { return 1e-5 * (i % 2); };
  for (int i = 0; i < 100; ++i) {
    f.motor_position = f.link_position = wobble(i);
    push(f);
  }
  f.link_position = 1.0;
  push(f);
  EXPECT_EQ(read(0x603F), 0x7306U);
  f.link_position = 0;
  push(f);
  EXPECT_TRUE(reset());
  f.motor_position = -1.0;
  push(f);
  EXPECT_EQ(read(0x603F), 0x7305U);
}

TEST_F(DriveSupervisionTest, AFrozenMotorEncoderOfAMovingDriveEndsInAFault) {
  enable();
  const double stuck = joint.motor;
  for (int cycle = 1; cycle <= 200 && node.state() == State::kOperationEnabled; ++cycle) {
    target(cycle * 5000);
    for (int i = 0; i < 20; ++i) {
      ServoFeedback wrong = joint.sense(p);
      wrong.motor_position = stuck;
      wrong.motor_velocity = 0;
      wrong.spring_torque = p.spring_constant * (stuck - wrong.link_position);
      torque = node.control(wrong, kStep);
      joint.move(p, torque, node.brake_engaged());
    }
  }
  EXPECT_NE(node.state(), State::kOperationEnabled);
  const std::uint32_t code = read(0x603F);
  EXPECT_TRUE(code == 0x7305 || code == 0x8611) << std::hex << code;
}

TEST_F(DriveSupervisionTest, MeasuredCurrent) {
  f.motor_current = 4;
  push(f);
  EXPECT_EQ(read(0x6078), 400U);  // per mille of 10 A
  f.motor_current = 20;           // 6073h: 150 % of 10 A
  push(f, 10);
  EXPECT_NE(node.state(), State::kFault);
  push(f, 20);
  EXPECT_EQ(read(0x603F), 0x2310U);
  EXPECT_THAT(heard(), testing::IsEmpty());
  EXPECT_EQ(read(0x1001), 0x03U);
  f.motor_current = 0;
  push(f);
  EXPECT_TRUE(reset());
}

TEST_F(DriveSupervisionTest, InputsAndOutputsPassThrough) {
  f.digital_inputs = 0x00010005;
  push(f);
  EXPECT_EQ(read(0x60FD), 0x00010005U);
  write(0x60FE, 1, 0x00030000, 4);
  EXPECT_EQ(node.digital_outputs(), 0U);
  write(0x60FE, 2, 0x00010000, 4);
  EXPECT_EQ(node.digital_outputs(), 0x00010000U);
}

TEST_F(DriveSupervisionTest, TheNewestStepIsWhatAClientReads) {
  for (int i = 1; i <= 9; ++i) {
    f.motor_position = i * 1e-3;
    f.link_position = i * 1e-3;
    f.link_velocity = i * 0.1;
    push(f);
    EXPECT_EQ(read_signed(0x6064), i * 1000);
    EXPECT_EQ(read_signed(0x6063), std::lround(i * 1e-3 / 4.8e-7));
    EXPECT_EQ(read_signed(0x60E5, 1), i * 100'000);
    EXPECT_THAT(talk.ask("080#"), Contains("285#" + [&] {
                  char text[20];
                  std::snprintf(text, sizeof text, "%02X%02X000000000000", i * 1000 & 0xFF, i * 1000 >> 8);
                  return std::string(text);
                }()));
  }
}

// A PDO that a timer sends between SYNCs shows the last of a physics step's four control steps.
TEST_F(DriveSupervisionTest, TimedPdosShowTheNewestPhysicsStep) {
  talk.ask("000#8005");
  for (const char* request : {"605#23031801850400C0", "605#23011801850200C0", "605#2F011802FF000000",
                              "605#2B01180501000000", "605#2301180185020040"}) {
    EXPECT_THAT(talk.ask(request), testing::ElementsAre(testing::StartsWith("585#60"))) << request;
  }
  talk.ask("000#0105");
  control(0x06);
  for (int ms = 1; ms <= 20; ++ms) {
    for (int i = 0; i < 4; ++i) {
      f.motor_position = f.link_position = ms * 1e-3 + i * 1e-5;
      push(f);
      if (i == 1 && ms % 5 == 0) control(ms % 2 == 0 ? 0x06 : 0x00);  // a change in the middle of a step
    }
    char text[24];
    std::snprintf(text, sizeof text, "285#%02X%02X000000000000", (ms * 1000 + 30) & 0xFF,
                  (ms * 1000 + 30) >> 8);
    EXPECT_EQ(talk.listen(milliseconds(2)).back(), text);
  }
}

}  // namespace
}  // namespace walkman::nodes
