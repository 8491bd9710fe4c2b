#include "emulator/nodes/cia301/object_dictionary.h"

#include <gtest/gtest.h>

namespace walkman::nodes {
namespace {

std::vector<std::uint8_t> bytes(std::initializer_list<int> values) { return {values.begin(), values.end()}; }

TEST(ObjectDictionary, ChecksRightsLengthAndLimits) {
  ObjectDictionary d;
  auto signed_value = d.add<std::int16_t>(0x6000, 0, Access::kReadWrite, -5).limits(-10, 10);
  d.add<std::uint32_t>(0x6001, 0, Access::kReadOnly, 7);
  d.add<std::uint8_t>(0x6002, 1, Access::kWriteOnly, 0);
  Entry& entry = *d.find(0x6000, 0);
  EXPECT_EQ(d.write(entry, bytes({0xF6, 0xFF})), std::nullopt);
  EXPECT_EQ(signed_value.get(), -10);
  EXPECT_EQ(d.write(entry, bytes({0xF5, 0xFF})), SdoAbort::kTooLow);
  EXPECT_EQ(d.write(entry, bytes({11, 0})), SdoAbort::kTooHigh);
  EXPECT_EQ(d.write(entry, bytes({1})), SdoAbort::kTooShort);
  EXPECT_EQ(d.write(entry, bytes({1, 0, 0})), SdoAbort::kTooLong);
  EXPECT_EQ(signed_value.get(), -10);
  EXPECT_EQ(d.write(*d.find(0x6001, 0), bytes({1, 0, 0, 0})), SdoAbort::kReadOnly);
  EXPECT_EQ(d.read(*d.find(0x6002, 1)), SdoAbort::kWriteOnly);
  EXPECT_EQ(d.find(0x6002, 0), nullptr);
  EXPECT_EQ(d.missing(0x6002), SdoAbort::kNoSubIndex);
  EXPECT_EQ(d.missing(0x6003), SdoAbort::kNoObject);
  EXPECT_THROW(d.add<std::uint8_t>(0x6002, 1, Access::kReadOnly, 0), std::runtime_error);
}

TEST(ObjectDictionary, HooksMayRefuse) {
  ObjectDictionary d;
  auto value = d.add<std::uint8_t>(0x2000, 0, Access::kReadWrite, 1);
  value.on_write([](std::uint8_t v) -> Verdict {
    if (v == 3) return SdoAbort::kValue;
    return std::nullopt;
  });
  EXPECT_EQ(d.write(*d.find(0x2000, 0), bytes({3})), SdoAbort::kValue);
  EXPECT_EQ(value.get(), 1);
  EXPECT_EQ(d.write(*d.find(0x2000, 0), bytes({4})), std::nullopt);
  EXPECT_EQ(value.get(), 4);
  d.power_on(0x2000, 0x2FFF);
  EXPECT_EQ(value.get(), 1);
}

}  // namespace
}  // namespace walkman::nodes
