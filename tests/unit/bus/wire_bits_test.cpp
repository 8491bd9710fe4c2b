#include "emulator/bus/wire_bits.h"

#include <random>
#include <string>

#include <gtest/gtest.h>

#include "emulator/bus/wire_coding.h"
#include "tests/unit/bus/reference_bits.h"

namespace walkman::bus {
namespace {

std::uint32_t crc_of(const char* text, const CrcKind& kind) {
  std::uint32_t crc = 0;
  for (const char* c = text; *c != 0; ++c) {
    for (int i = 7; i >= 0; --i) crc = crc_bit(kind, crc, static_cast<unsigned>(*c) >> i & 1U);
  }
  return crc;
}

// Check values of the CRC catalogue (CRC-15/CAN, CRC-17/CAN-FD, CRC-21/CAN-FD), where the CRC starts at zero.
TEST(Crc, PolynomialsHaveTheCataloguesCheckValues) {
  EXPECT_EQ(crc_of("123456789", kCrc15), 0x059EU);
  EXPECT_EQ(crc_of("123456789", kCrc17), 0x04F03U);
  EXPECT_EQ(crc_of("123456789", kCrc21), 0x0ED841U);
  std::uint32_t crc = 0;
  for (const char c : std::string("123456789")) crc = crc15_byte(crc, static_cast<std::uint8_t>(c));
  EXPECT_EQ(crc, 0x059EU);
}

std::string levels(const WireBits& wire) {
  std::string text;
  for (int i = 0; i < wire.size(); ++i) text.push_back(wire.level(i) != 0 ? '1' : '0');
  return text;
}

TEST(WireBits, EveryBitIsTheReferences) {
  std::mt19937 random(21);
  for (int trial = 0; trial < 5000; ++trial) {
    static constexpr std::uint8_t kFdLengths[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};
    can::Frame frame;
    frame.fd = trial % 2 == 0;
    frame.extended = random() % 2 == 0;
    frame.remote = !frame.fd && random() % 4 == 0;
    frame.id = random() & (frame.extended ? 0x1FFFFFFFU : 0x7FFU);
    frame.length = frame.fd ? kFdLengths[random() % 16] : static_cast<std::uint8_t>(random() % 9);
    for (std::size_t i = 0; i < frame.length; ++i) {
      frame.data[i] = static_cast<std::uint8_t>(random() % 3 == 0 ? random() : random() % 2 * 0xFF);
    }
    const bool passive = random() % 2 == 0;
    const WireBits wire(frame, passive);
    const ReferenceBits expected = reference_bits(frame, passive);
    ASSERT_EQ(levels(wire) + "111", expected.bits) << frame.id << (frame.fd ? " FD" : "");
    WireLength all = wire.length_to(wire.size() - 1);
    all.nominal += kIntermissionBits;
    ASSERT_EQ(all, wire_length(frame, passive));
    ASSERT_EQ(all, (WireLength{expected.nominal(), expected.data()}));
  }
}

TEST(WireBits, AHandWrittenFrame) {
  // 080#: SOF, 000 1000 0000, RTR, IDE, r0, DLC 0000, then the CRC; 51 bits with intermission.
  const WireBits wire({0x080, {}});
  EXPECT_EQ(levels(wire).substr(0, 23), "00001000001000001000001");
  EXPECT_EQ(wire.size(), 51 - kIntermissionBits);
  EXPECT_EQ(wire.field(0), FrameField::kStartOfFrame);
  EXPECT_EQ(wire.field(1), FrameField::kIdentifier28To21);
  EXPECT_EQ(wire.field(wire.ack_slot() - 1), FrameField::kCrcDelimiter);
  EXPECT_EQ(wire.field(wire.ack_slot()), FrameField::kAckSlot);
  EXPECT_EQ(wire.field(wire.size() - 1), FrameField::kEndOfFrame);
}

TEST(WireBits, TheLongestFrameFits) {
  can::Frame frame;
  frame.fd = true;
  frame.extended = true;
  frame.length = 64;
  const WireBits wire(frame);
  EXPECT_GT(wire.size(), 41 + 512 + 33 + 9 + 100);
}

}  // namespace
}  // namespace walkman::bus
