#include "emulator/datasheets/wire_unit.h"

#include <gtest/gtest.h>

namespace walkman::datasheets {
namespace {

using nodes::Access;

void expect_unit(const WireUnit& unit, const std::string& text, double factor) {
  EXPECT_EQ(unit.text, text);
  EXPECT_DOUBLE_EQ(unit.factor, factor);
}

TEST(WireUnit, OfDriveObjectsDependsOnTheRatings) {
  nodes::ObjectDictionary d;
  d.add<std::uint32_t>(0x6076, 0, Access::kReadOnly, 60000);  // mN m
  d.add<std::uint32_t>(0x6075, 0, Access::kReadOnly, 8000);   // mA
  expect_unit(wire_unit(d, {0x6064, 0}), "rad", 1e-6);
  expect_unit(wire_unit(d, {0x6084, 0}), "rad/s^2", 1e-6);
  expect_unit(wire_unit(d, {0x6077, 0}), "Nm", 0.06);
  expect_unit(wire_unit(d, {0x6078, 0}), "A", 0.008);
  expect_unit(wire_unit(d, {0x2030, 1}), "degC", 0.1);
  expect_unit(wire_unit(d, {0x2020, 2}), "Nm", 1e-3);
  expect_unit(wire_unit(d, {0x6041, 0}), "", 1);
}

TEST(WireUnit, PerMilleWithoutARatingIsAShare) {
  const nodes::ObjectDictionary empty;
  expect_unit(wire_unit(empty, {0x6077, 0}), "", 1e-3);
}

TEST(WireUnit, OfMeasuredValuesIsInTheDictionary) {
  nodes::ObjectDictionary d;
  d.add<std::uint32_t>(0x6131, 1, Access::kReadOnly, 0x00210000);  // newton
  d.add<std::uint8_t>(0x6132, 1, Access::kReadOnly, 1);
  d.add<std::uint32_t>(0x6131, 2, Access::kReadOnly, 0x00015700);  // m/s^2
  d.add<std::uint8_t>(0x6132, 2, Access::kReadOnly, 3);
  expect_unit(wire_unit(d, {0x7130, 1}), "N", 0.1);
  expect_unit(wire_unit(d, {0x6130, 1}), "N", 1);
  expect_unit(wire_unit(d, {0x9130, 2}), "m/s^2", 1e-3);
  expect_unit(wire_unit(d, {0x7130, 3}), "", 1);  // no such channel
}

TEST(WireUnit, CodesOfCia303) {
  expect_unit(unit_of_code(0x002D0000), "degC", 1);
  expect_unit(unit_of_code(0xFA100300), "rad/s", 1e-6);
  expect_unit(unit_of_code(0xFD010000), "m", 1e-3);
  expect_unit(unit_of_code(0x00FF0000), "", 1);
  expect_unit(unit_of_code(0x0001FF00), "", 1);
}

}  // namespace
}  // namespace walkman::datasheets
