#include "emulator/bus/frame_length.h"

#include <algorithm>
#include <map>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/unit/bus/reference_bits.h"

namespace walkman::bus {
namespace {

struct Vector {
  can::Frame frame;
  int bits;
};

// Lengths on which two calculators by other authors agree, one of them can-utils' CFL_EXACT.
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

can::Frame random_frame(std::mt19937& random, bool fd) {
  static const std::vector<int> kFdLengths = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};
  can::Frame frame;
  frame.fd = fd;
  frame.extended = random() % 2 == 0;
  frame.remote = !fd && random() % 4 == 0;
  frame.id = random() & (frame.extended ? 0x1FFFFFFFU : 0x7FFU);
  // Runs of equal bits as well as arbitrary bytes.
  if (random() % 4 == 0) frame.id &= random();
  frame.length = static_cast<std::uint8_t>(fd ? kFdLengths[random() % kFdLengths.size()] : random() % 9);
  for (std::size_t i = 0; i < frame.length; ++i) {
    const std::uint8_t bytes[] = {0x00, 0xFF, 0x1F, 0x07, static_cast<std::uint8_t>(random())};
    frame.data[i] = bytes[random() % 5];
  }
  return frame;
}

TEST(FrameLength, AgreesWithTheReferenceOnAnyClassicalFrame) {
  std::mt19937 random(11);
  for (int trial = 0; trial < 20'000; ++trial) {
    const can::Frame frame = random_frame(random, false);
    ASSERT_EQ(frame_bits(frame), static_cast<int>(reference_bits(frame).bits.size()));
    ASSERT_EQ(wire_length(frame), (WireLength{frame_bits(frame), 0}));
  }
}

TEST(FdFrameLength, AgreesWithTheReferenceOnAnyFrame) {
  std::mt19937 random(12);
  for (int trial = 0; trial < 20'000; ++trial) {
    const can::Frame frame = random_frame(random, true);
    const bool passive = trial % 2 == 0;
    const ReferenceBits expected = reference_bits(frame, passive);
    ASSERT_EQ(wire_length(frame, passive), (WireLength{expected.nominal(), expected.data()}))
        << frame.id << " " << static_cast<int>(frame.length);
  }
}

can::Frame fd_frame(std::uint32_t id, std::size_t length) {
  can::Frame frame;
  frame.id = id;
  frame.fd = true;
  frame.length = static_cast<std::uint8_t>(length);
  return frame;
}

/// Payload that continues with runs of four from the end of the DLC, so that every fifth bit is a stuff bit.
/// `first`, `value`: number of bits still missing from the first run, and their value.
can::Frame worst_fd_frame(std::size_t length, unsigned first, unsigned value) {
  can::Frame frame = fd_frame(0x00F0 >> 1U, length);  // 000 0111 1000, RRS and IDE 0: three stuff bits
  unsigned left = first;
  for (std::size_t bit = 0; bit < 8 * length; ++bit) {
    if (left == 0) {
      value ^= 1U;
      left = 4;
    }
    frame.data[bit / 8] = static_cast<std::uint8_t>(frame.data[bit / 8] | value << (7 - bit % 8));
    --left;
  }
  return frame;
}

/// Largest number of stuff bits that any payload can produce after BRS: dynamic programming, bit by bit, over
/// the last bit and the length of its run.
int most_data_stuff_bits(std::size_t length) {
  const std::string head = binary(fd_length_code(static_cast<unsigned>(length)), 5);  // ESI 0, DLC
  std::map<std::pair<char, int>, int> best = {{{'1', 1}, 0}};  // BRS, which follows a dominant bit
  for (std::size_t i = 0; i < head.size() + 8 * length; ++i) {
    std::map<std::pair<char, int>, int> next;
    for (const char bit : {'0', '1'}) {
      if (i < head.size() && bit != head[i]) continue;
      for (const auto& [state, count] : best) {
        auto [last, run] = state;
        int more = 0;
        if (run == 5) {
          last = last == '0' ? '1' : '0';
          run = 1;
          more = 1;
        }
        int& entry = next[{bit, bit == last ? run + 1 : 1}];
        entry = std::max(entry, count + more);
      }
    }
    best = next;
  }
  int most = 0;
  for (const auto& [state, count] : best) most = std::max(most, count);
  return most;
}

TEST(FdFrameLength, TheTablesWorstCaseHolds) {
  struct Row {
    std::size_t length;
    unsigned first, value;  // the run left open by the last bits of the DLC
    int data_bits;          // after BRS without stuff bits: ESI, DLC, data, check, delimiter
    int stuff_bits;         // counted by hand: a run of five, then one for every four bits but the last
    double at_5, at_8;      // us, from the bandwidth tables of the protocol notes
  };
  // The DLC ends in 000 (8), 0 (16), 00 (24), 1 (32), 1111 (64).
  const std::vector<Row> rows = {{8, 2, 0, 5 + 64 + 28, 16, 55.8, 47.2},
                                 {16, 4, 0, 5 + 128 + 28, 31, 71.8, 57.2},
                                 {24, 3, 0, 5 + 192 + 33, 48, 88.8, 67.9},
                                 {32, 4, 1, 5 + 256 + 33, 63, 104.8, 77.9},
                                 {64, 1, 1, 5 + 512 + 33, 128, 168.8, 117.9}};
  for (const Row& row : rows) {
    const WireLength length = wire_length(worst_fd_frame(row.length, row.first, row.value));
    EXPECT_EQ(length, (WireLength{17 + 3 + 12, row.data_bits + row.stuff_bits})) << row.length;
    EXPECT_EQ(most_data_stuff_bits(row.length), row.stuff_bits) << row.length;
    // The table counts one stuff bit for every four bits from SOF on. One of those in the header is
    // impossible (IDE, FDF, res and BRS alternate), and so are one or two after it (ESI and DLC; a fixed one
    // at the end).
    const double at_5 = static_cast<double>(duration(length, 1'000'000, 5'000'000).count()) * 1e-3;
    const double at_8 = static_cast<double>(duration(length, 1'000'000, 8'000'000).count()) * 1e-3;
    EXPECT_LE(at_5, row.at_5);
    EXPECT_GE(at_5, row.at_5 - 1 - 2 / 5.0 - 0.05);
    EXPECT_LE(at_8, row.at_8 + 0.05);
    EXPECT_GE(at_8, row.at_8 - 1 - 2 / 8.0 - 0.05);
  }
}

TEST(FdFrameLength, NoFrameIsLongerThanTheWorstCase) {
  std::mt19937 random(5);
  for (const std::size_t length : {0, 1, 7, 8, 12, 16, 20, 24, 32, 48, 64}) {
    const int g = 22 + 8 * static_cast<int>(length);
    const int rest = 12 + 4 + 1 + (length <= 16 ? 17 + 6 : 21 + 7);
    int longest = 0;
    for (int trial = 0; trial < 2000; ++trial) {
      can::Frame frame = random_frame(random, true);
      frame.extended = false;
      frame.id &= 0x7FFU;
      frame.length = static_cast<std::uint8_t>(length);
      const WireLength bits = wire_length(frame);
      ASSERT_GE(bits.bits(), g + rest);
      ASSERT_LE(bits.bits(), g + (g - 1) / 4 + rest);
      ASSERT_LE(bits.nominal, 17 + 3 + 12);
      longest = std::max(longest, bits.bits());
    }
    EXPECT_GT(longest, g + rest);
  }
}

TEST(FdFrameLength, LengthCodes) {
  const std::vector<unsigned> lengths = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};
  for (unsigned code = 0; code < 16; ++code) {
    EXPECT_EQ(fd_length_code(lengths[code]), code);
  }
  EXPECT_EQ(fd_length_code(9), 9U);
  EXPECT_EQ(fd_length_code(33), 14U);
  for (unsigned n = 0; n <= 64; ++n) {
    const bool valid = std::find(lengths.begin(), lengths.end(), n) != lengths.end();
    EXPECT_EQ(is_sendable(fd_frame(0x181, n)), valid) << n;
  }
  // 19 bytes are sent as 20.
  EXPECT_EQ(wire_length(fd_frame(0x181, 19)), wire_length(fd_frame(0x181, 20)));
}

TEST(FrameLength, DurationIsThatOfBothRates) {
  EXPECT_EQ(duration({51, 0}, 1'000'000, 5'000'000), std::chrono::microseconds(51));
  EXPECT_EQ(duration({51, 0}, 125'000, 5'000'000), std::chrono::microseconds(408));
  EXPECT_EQ(duration({29, 97}, 1'000'000, 5'000'000), std::chrono::nanoseconds(29'000 + 19'400));
  EXPECT_EQ(duration({29, 97}, 500'000, 8'000'000), std::chrono::nanoseconds(58'000 + 12'125));
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
