#include "emulator/datasheets/wire_unit.h"

#include <gtest/gtest.h>

#include "emulator/nodes/drive/drive_node.h"
#include "emulator/nodes/measuring/force_torque_node.h"
#include "emulator/nodes/measuring/inertial_node.h"
#include "tests/unit/nodes/test_drive.h"

namespace walkman::datasheets {
namespace {

void expect_unit(const WireUnit& unit, const std::string& text, double factor) {
  EXPECT_EQ(unit.text, text);
  EXPECT_DOUBLE_EQ(unit.factor, factor);
}

TEST(WireUnit, OfDriveObjectsDependsOnTheRatings) {
  nodes::DriveParameters parameters = nodes::test_drive();
  parameters.rated_torque = 60;
  parameters.rated_current = 8;
  const nodes::DriveNode drive(parameters);
  const auto unit = [&](std::uint16_t index, std::uint8_t sub) {
    return wire_unit(drive.dictionary(), *drive.dictionary().find(index, sub));
  };
  expect_unit(unit(0x6064, 0), "rad", 1e-6);
  expect_unit(unit(0x6084, 0), "rad/s^2", 1e-6);
  expect_unit(unit(0x6077, 0), "Nm", 0.06);
  expect_unit(unit(0x6078, 0), "A", 0.008);
  expect_unit(unit(0x2030, 1), "degC", 0.1);
  expect_unit(unit(0x2020, 2), "Nm", 1e-3);
  expect_unit(unit(0x6041, 0), "", 1);
}

TEST(WireUnit, OfMeasuredValuesIsInTheDictionary) {
  nodes::ForceTorqueParameters force_torque;
  force_torque.node_id = 18;
  const nodes::ForceTorqueNode sensor(force_torque);
  nodes::InertialParameters inertial;
  inertial.node_id = 91;
  const nodes::InertialNode unit(inertial);
  const auto of = [](const nodes::CanopenSlave& node, std::uint16_t index, std::uint8_t sub) {
    return wire_unit(node.dictionary(), *node.dictionary().find(index, sub));
  };
  expect_unit(of(sensor, 0x7130, 1), "N", 0.1);
  expect_unit(of(sensor, 0x6130, 1), "N", 1);
  expect_unit(of(sensor, 0x9130, 6), "Nm", 0.01);
  expect_unit(of(unit, 0x9130, 2), "N/kg", 1e-3);
  expect_unit(of(unit, 0x7130, 10), "", 1.0 / 30000);
  expect_unit(of(unit, 0x6130, 10), "", 1);
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
