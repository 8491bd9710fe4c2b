#pragma once

#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "tests/unit/nodes/conversation.h"
#include "tests/unit/nodes/test_drive.h"

namespace walkman::nodes {

inline constexpr double kStep = 0.00025;
// Bits of the statusword.
inline constexpr unsigned kReached = 1U << 10U;
inline constexpr unsigned kLimit = 1U << 11U;
inline constexpr unsigned kBit12 = 1U << 12U;

/// Motor, spring and link of one joint; the servo runs at 4 kHz, the mechanics in steps ten times finer.
struct Joint {
  double motor = 0, motor_v = 0, link = 0, link_v = 0;
  double link_inertia = 0.5, load = 0;
  bool link_locked = false;

  static double encoder(double angle) {
    constexpr double kTick = 2 * std::numbers::pi / (1 << 20);
    return std::round(angle / kTick) * kTick;
  }
  [[nodiscard]] ServoFeedback sense(const DriveParameters& p) const {
    ServoFeedback f;
    f.motor_position = encoder(motor);
    f.link_position = encoder(link);
    f.motor_velocity = std::round(motor_v / 1e-3) * 1e-3;
    f.link_velocity = std::round(link_v / 1e-3) * 1e-3;
    f.spring_torque = p.spring_constant * (f.motor_position - f.link_position);
    return f;
  }
  void move(const DriveParameters& p, double torque, bool brake) {
    constexpr int kFine = 10;
    for (int i = 0; i < kFine; ++i) {
      const double dt = kStep / kFine;
      const double spring = p.spring_constant * (motor - link);
      const double spring_and_friction = spring + 1.0 * (motor_v - link_v);
      motor_v = brake ? 0 : motor_v + (torque - spring_and_friction) / p.motor_inertia * dt;
      motor += motor_v * dt;
      if (link_locked) continue;
      link_v += (spring_and_friction + load - 2.0 * link_v) / link_inertia * dt;
      link += link_v * dt;
    }
  }
};

/// A drive with its joint, addressed in frames: node-ID 5, operational.
struct JointRig : testing::Test {
  JointRig() {
    talk.listen(milliseconds(2));
    run(0.001);
    talk.ask("000#0105");
  }
  void run(double seconds) {
    const int steps = static_cast<int>(std::lround(seconds / kStep));
    for (int i = 0; i < steps; ++i) step();
  }
  void step() {
    torque = node.control(joint.sense(p), kStep);
    joint.move(p, torque, node.brake_engaged());
  }
  void enable(const std::string& mode = "08") {
    for (const char* word : {"06", "07", "0F"}) talk.ask(std::string("205#") + word + "00" + mode + "0000");
  }
  void target(std::int32_t urad) {
    char text[32];
    const auto value = static_cast<std::uint32_t>(urad);
    std::snprintf(text, sizeof text, "305#%02X%02X%02X%02X00000000", value & 0xFFU, value >> 8U & 0xFFU,
                  value >> 16U & 0xFFU, value >> 24U);
    talk.send(text);
    talk.ask("080#");
  }
  /// Returns the statusword or any other object of up to four bytes as an SDO client reads it.
  std::uint32_t read(unsigned index, unsigned sub = 0) {
    char text[32];
    std::snprintf(text, sizeof text, "605#40%02X%02X%02X00000000", index & 0xFFU, index >> 8U, sub);
    for (const std::string& answer : talk.ask(text)) {
      if (answer.rfind("585#4", 0) == 0) return frame_value(answer, 12);
    }
    ADD_FAILURE() << "no answer to " << text;
    return 0;
  }
  std::int32_t read_signed(unsigned index, unsigned sub = 0) {
    return static_cast<std::int32_t>(read(index, sub));
  }
  /// Expedited download of `bytes` bytes; returns the abort code, or 0.
  std::uint32_t write(unsigned index, unsigned sub, std::int64_t value, int bytes) {
    const unsigned command[] = {0, 0x2F, 0x2B, 0x27, 0x23};
    const auto v = static_cast<std::uint32_t>(value);
    char text[40];
    std::snprintf(text, sizeof text, "605#%02X%02X%02X%02X%02X%02X%02X%02X", command[bytes], index & 0xFFU,
                  index >> 8U, sub, v & 0xFFU, bytes > 1 ? v >> 8U & 0xFFU : 0,
                  bytes > 2 ? v >> 16U & 0xFFU : 0, bytes > 3 ? v >> 24U : 0);
    for (const std::string& answer : talk.ask(text)) {
      if (answer.rfind("585#60", 0) == 0) return 0;
      if (answer.rfind("585#80", 0) == 0) return frame_value(answer, 12);
    }
    ADD_FAILURE() << "no answer to " << text;
    return 1;
  }
  std::uint32_t status() { return read(0x6041); }
  std::uint32_t control(unsigned word) { return write(0x6040, 0, word, 2); }
  /// Returns the little-endian number of four bytes at position `at` of a frame's text.
  static std::uint32_t frame_value(const std::string& frame, std::size_t at) {
    std::uint32_t value = 0;
    for (int i = 3; i >= 0; --i) {
      const auto digits = frame.substr(at + 2 * static_cast<std::size_t>(i), 2);
      value = value << 8U | static_cast<std::uint32_t>(std::stoul(digits, nullptr, 16));
    }
    return value;
  }
  DriveParameters p = test_drive();
  DriveNode node{p};
  Conversation talk{node};
  Joint joint;
  double torque = 0;
};

}  // namespace walkman::nodes
