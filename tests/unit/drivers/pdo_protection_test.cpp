#include "drivers/canopen/pdo_protection.h"

#include <algorithm>
#include <cstdint>

#include <gtest/gtest.h>

namespace walkman::canopen {
namespace {

using Verdict = PdoGuard::Verdict;
constexpr std::size_t kBytes = 8;

can::Frame sent(std::uint8_t count) {
  can::Frame frame(0x18B, {0x37, 0x12, 0xA0, 0x86, 0x01, 0x00, 0x00, 0x00});
  protect(frame, kBytes, count);
  return frame;
}

// Check value for CRC-8/AUTOSAR from the catalogue of parametrised CRC algorithms: DFh for "123456789".
TEST(PdoProtection, IsTheCataloguesCrc) {
  can::Frame frame(0x3231, {'3', '4', '5', '6', '7', '8', 0, 0});
  protect(frame, kBytes, '9');
  EXPECT_EQ(frame.data[6], '9');
  EXPECT_EQ(frame.data[7], 0xDF);
}

TEST(PdoProtection, DetectsEveryErrorOfUpToThreeBits) {
  const can::Frame sound = sent(1);
  const auto passes = [](const can::Frame& frame) {
    PdoGuard guard;
    return guard.judge(frame, kBytes) == Verdict::kNew;
  };
  ASSERT_TRUE(passes(sound));
  const auto turned = [](can::Frame frame, unsigned bit) {
    frame.data[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
    return frame;
  };
  int passed = 0;
  for (unsigned i = 0; i < 8 * kBytes; ++i) {
    const can::Frame one = turned(sound, i);
    passed += passes(one) ? 1 : 0;
    for (unsigned j = i + 1; j < 8 * kBytes; ++j) {
      const can::Frame two = turned(one, j);
      passed += passes(two) ? 1 : 0;
      for (unsigned k = j + 1; k < 8 * kBytes; ++k) passed += passes(turned(two, k)) ? 1 : 0;
    }
  }
  EXPECT_EQ(passed, 0);
}

TEST(PdoProtection, AnotherPdosFrameIsNoneOfThis) {
  can::Frame frame = sent(1);
  frame.id = 0x28B;
  EXPECT_EQ(PdoGuard().judge(frame, kBytes), Verdict::kCorrupt);
}

// 10 bytes of objects are sent in a CAN FD frame of 12.
TEST(PdoProtection, AFramesPaddingIsNoPartOfIt) {
  constexpr std::size_t kObjects = 10;
  can::Frame frame(0x18B, {0x37, 0x12, 0xA0, 0x86, 0x01, 0x00, 0x21, 0x43, 0x00, 0x00, 0x00, 0x00});
  frame.fd = true;
  protect(frame, kObjects, 1);
  EXPECT_EQ(frame.data[8], 1);
  EXPECT_EQ(frame.data[10] | frame.data[11], 0);
  frame.data[11] = 0xCC;
  EXPECT_EQ(PdoGuard().judge(frame, kObjects), Verdict::kNew);
  frame.data[7] ^= 1;
  EXPECT_EQ(PdoGuard().judge(frame, kObjects), Verdict::kCorrupt);
}

TEST(PdoProtection, OldFramesAreToldFromNewOnes) {
  PdoGuard guard;
  for (int count = 0; count < 600; ++count)
    ASSERT_EQ(guard.judge(sent(static_cast<std::uint8_t>(count)), kBytes), Verdict::kNew) << count;
  // Count 599 is sent as 57h.
  EXPECT_EQ(guard.judge(sent(0x57), kBytes), Verdict::kRepeated);
  EXPECT_EQ(guard.judge(sent(0x50), kBytes), Verdict::kRepeated);
  EXPECT_EQ(guard.judge(sent(0x5C), kBytes), Verdict::kNew) << "four were lost";
  guard.restart();
  EXPECT_EQ(guard.judge(sent(0x5C), kBytes), Verdict::kNew);
}

}  // namespace
}  // namespace walkman::canopen
