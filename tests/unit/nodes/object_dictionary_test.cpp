#include "emulator/nodes/cia301/object_dictionary.h"

#include <gtest/gtest.h>

namespace walkman::nodes {
namespace {

std::vector<std::uint8_t> bytes(std::initializer_list<int> values) { return {values.begin(), values.end()}; }

TEST(ObjectDictionary, ChecksRightsLengthAndLimits) {
  ObjectDictionary d;
  d.add(variable(0x6000, read_write<std::int16_t>("Signed", -5).within(-10, 10)));
  d.add(variable(0x6001, read_only<std::uint32_t>("Fixed", 7)));
  d.add(array(0x6002, "Commands", {{}, write_only<std::uint8_t>("Command")}));
  auto signed_value = d.object<std::int16_t>(0x6000);
  Entry& entry = *d.find(0x6000, 0);
  EXPECT_EQ(d.write(entry, bytes({0xF6, 0xFF})), std::nullopt);
  EXPECT_EQ(signed_value.get(), -10);
  EXPECT_EQ(d.write(entry, bytes({0xF5, 0xFF})), SdoAbort::kTooLow);
  EXPECT_EQ(d.write(entry, bytes({11, 0})), SdoAbort::kTooHigh);
  EXPECT_EQ(d.write(entry, bytes({1})), SdoAbort::kTooShort);
  EXPECT_EQ(d.write(entry, bytes({1, 0, 0})), SdoAbort::kTooLong);
  EXPECT_EQ(signed_value.get(), -10);
  EXPECT_EQ(d.write(*d.find(0x6001, 0), bytes({1, 0, 0, 0})), SdoAbort::kReadOnly);
  EXPECT_EQ(d.read(*d.find(0x6002, 2)), SdoAbort::kWriteOnly);
  EXPECT_EQ(d.find(0x6002, 1), nullptr);
  EXPECT_EQ(d.missing(0x6002), SdoAbort::kNoSubIndex);
  EXPECT_EQ(d.missing(0x6003), SdoAbort::kNoObject);
  EXPECT_THROW(d.add(variable(0x6001, read_only<std::uint8_t>("Again"))), std::runtime_error);
  EXPECT_THROW(static_cast<void>(d.object<std::uint16_t>(0x6001)), std::runtime_error);
  EXPECT_THROW(static_cast<void>(d.object<std::uint32_t>(0x6003)), std::runtime_error);
}

TEST(ObjectDictionary, TakesOneOfTheValuesAllowed) {
  ObjectDictionary d;
  d.add(variable(0x6000, read_write<std::int8_t>("Choice").one_of({0, 35, 37})));
  Entry& entry = *d.find(0x6000, 0);
  EXPECT_EQ(d.write(entry, bytes({35})), std::nullopt);
  EXPECT_EQ(d.write(entry, bytes({36})), SdoAbort::kValue);
  EXPECT_EQ(d.write(entry, bytes({38})), SdoAbort::kTooHigh);
  EXPECT_EQ(d.write(entry, bytes({0xFF})), SdoAbort::kTooLow);
  EXPECT_EQ(from_raw<std::int8_t>(entry.raw), 35);
}

TEST(ObjectDictionary, AddsTheNodeIdAndOneObjectForEachNumber) {
  ObjectDictionary d(5);
  ObjectRow row = record(0x1400, "PDO {}", {read_write<std::uint32_t>("COB-ID", 0x200).plus_node_id()});
  row.objects = 2;
  d.add(row);
  EXPECT_EQ(d.object<std::uint32_t>(0x1401, 1).get(), 0x205U);
  EXPECT_EQ(d.object<std::uint8_t>(0x1401, 0).get(), 1);
  d.shift_node_id(2);
  EXPECT_EQ(d.find(0x1400, 1)->default_raw, 0x207U);
  EXPECT_EQ(d.find(0x1402, 0), nullptr);
}

TEST(ObjectDictionary, HooksMayRefuse) {
  ObjectDictionary d;
  d.add(variable(0x2000, read_write<std::uint8_t>("Value", 1)));
  auto value = d.object<std::uint8_t>(0x2000);
  value.on_write([](std::uint8_t v) -> Refusal {
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
