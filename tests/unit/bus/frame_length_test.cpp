#include "emulator/bus/frame_length.h"

#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace walkman::bus {
namespace {

struct Vector {
  can::Frame frame;
  int bits;
};

// Lengths that two calculators of other authors agree on, one of them can-utils' CFL_EXACT.
TEST(FrameLength, AgreesWithIndependentCalculators) {
  const std::vector<Vector> vectors = {
      {{0x080, {}}, 51},
      {{0x7FF, {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}}, 126},
      {{0x000, {0x01, 0x05}}, 70},
      {{0x000, {0, 0, 0, 0, 0, 0, 0, 0}}, 127},
      {{0x705, {0x05}}, 59},
      {{0x605, {0x40, 0x41, 0x60, 0, 0, 0, 0, 0}}, 124},
      {{0x185, {0x37, 0x06}}, 66},
      {{0x123, {0xDE, 0xAD, 0xBE, 0xEF}}, 81},
      {{0x205, {0x0F, 0x00, 0x10, 0x27, 0, 0, 0, 0}}, 123},
      {{0x555, {0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55, 0x55}}, 112},
      {{0x185, {0x37, 0x06, 0xE8, 0x03, 0x00, 0x00, 0xF4, 0x01}}, 119},
  };
  for (const Vector& v : vectors) EXPECT_EQ(frame_bits(v.frame), v.bits) << std::hex << v.frame.id;
}

TEST(FrameLength, StaysWithinTheStandardsBoundsAndNearTheKnownMean) {
  // Means over random identifiers and data, from the bandwidth tables of the protocol notes.
  const std::vector<std::pair<int, double>> means = {{0, 49.0}, {1, 57.0}, {2, 65.2},  {4, 81.3},
                                                     {5, 89.5}, {6, 97.8}, {7, 106.4}, {8, 114.3}};
  std::mt19937 random(7);
  for (int n = 0; n <= 8; ++n) {
    const int stuffed = 34 + 8 * n;
    double sum = 0;
    constexpr int kTrials = 4000;
    for (int trial = 0; trial < kTrials; ++trial) {
      can::Frame frame;
      frame.id = random() & 0x7FFU;
      frame.length = static_cast<std::uint8_t>(n);
      for (int i = 0; i < n; ++i)
        frame.data[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(random());
      const int bits = frame_bits(frame);
      ASSERT_GE(bits, stuffed + 13);
      ASSERT_LE(bits, stuffed + (stuffed - 1) / 4 + 13);
      sum += bits;
    }
    for (const auto& [length, mean] : means) {
      if (length == n) {
        EXPECT_NEAR(sum / kTrials, mean, 0.3) << n << " bytes";
      }
    }
  }
}

TEST(FrameLength, RemoteFrameCarriesNoData) {
  can::Frame frame(0x123, {1, 2, 3, 4});
  frame.remote = true;
  EXPECT_LE(frame_bits(frame), 55);
  EXPECT_GE(frame_bits(frame), 47);
}

TEST(FrameLength, ExtendedFrameHas20BitsMore) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 1000; ++trial) {
    can::Frame frame(random() & 0x1FFFFFFFU, {0x55, 0x55});
    frame.extended = true;
    EXPECT_GE(frame_bits(frame), 54 + 16 + 13);
    EXPECT_LE(frame_bits(frame), 54 + 16 + (54 + 16 - 1) / 4 + 13);
  }
}

TEST(Arbitration, BaseDataBeforeRemoteBeforeExtended) {
  can::Frame base(0x123, {1});
  can::Frame remote = base;
  remote.remote = true;
  can::Frame extended(0x123U << 18U, {1});
  extended.extended = true;
  can::Frame next(0x124, {1});
  EXPECT_LT(arbitration_key(base), arbitration_key(remote));
  EXPECT_LT(arbitration_key(remote), arbitration_key(extended));
  EXPECT_LT(arbitration_key(extended), arbitration_key(next));
}

}  // namespace
}  // namespace walkman::bus
