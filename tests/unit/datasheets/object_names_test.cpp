#include "emulator/datasheets/object_names.h"

#include <set>

#include <gmock/gmock.h>

#include "emulator/nodes/cia301/communication_table.h"
#include "emulator/nodes/drive/drive_node.h"
#include "emulator/nodes/drive/drive_table.h"
#include "emulator/nodes/measuring/force_torque_node.h"
#include "emulator/nodes/measuring/inertial_node.h"
#include "emulator/nodes/measuring/measuring_table.h"
#include "tests/unit/nodes/test_drive.h"

namespace walkman::datasheets {
namespace {

TEST(ObjectNames, AreThoseOfTheStandards) {
  const nodes::DriveNode drive(nodes::test_drive());
  const auto name = [&](std::uint16_t index, std::uint8_t sub) {
    return entry_name(drive.dictionary(), *drive.dictionary().find(index, sub));
  };
  EXPECT_EQ(name(0x1000, 0), "Device type");
  EXPECT_EQ(name(0x1018, 0), "Highest sub-index supported");
  EXPECT_EQ(name(0x1018, 4), "Serial number");
  EXPECT_EQ(name(0x1003, 0), "Number of errors");
  const auto object = [&](std::uint16_t index) { return object_name(*drive.dictionary().find(index, 0)); };
  EXPECT_EQ(object(0x1402), "RPDO 3 communication parameter");
  EXPECT_EQ(name(0x1402, 5), "Event timer");
  EXPECT_EQ(object(0x1A00), "TPDO 1 mapping parameter");
  EXPECT_EQ(name(0x1A00, 8), "Mapped object 8");
  EXPECT_EQ(name(0x6041, 0), "Statusword");
  EXPECT_EQ(name(0x607D, 2), "Max position limit");
  EXPECT_EQ(entry_symbol(drive.dictionary(), *drive.dictionary().find(0x6064, 0)), "position_actual");
}

TEST(ObjectNames, ChannelsAreCalledAfterWhatTheyMeasure) {
  nodes::ForceTorqueParameters parameters;
  parameters.node_id = 18;
  const nodes::ForceTorqueNode sensor(parameters);
  EXPECT_EQ(entry_name(sensor.dictionary(), *sensor.dictionary().find(0x7130, 1)), "Fx");
  EXPECT_EQ(entry_name(sensor.dictionary(), *sensor.dictionary().find(0x7130, 6)), "Tz");
  EXPECT_EQ(entry_symbol(sensor.dictionary(), *sensor.dictionary().find(0x7130, 5)), "pv_Ty");
}

TEST(ObjectNames, ChannelsOfAnInertialUnit) {
  nodes::InertialParameters parameters;
  parameters.node_id = 91;
  const nodes::InertialNode unit(parameters);
  EXPECT_EQ(entry_name(unit.dictionary(), *unit.dictionary().find(0x7130, 3)), "az");
  EXPECT_EQ(entry_name(unit.dictionary(), *unit.dictionary().find(0x7130, 4)), "wx");
  EXPECT_EQ(entry_name(unit.dictionary(), *unit.dictionary().find(0x7130, 7)), "qw");
  EXPECT_EQ(entry_name(unit.dictionary(), *unit.dictionary().find(0x7130, 10)), "qz");
}

// Each name belongs to one object, within a device and across the tables, except for what two profiles share.
TEST(ObjectNames, AreUniqueAndFitAnEds) {
  using namespace nodes;
  std::set<std::string_view> names;
  std::set<std::uint16_t> indices;
  for (const ObjectTable table : {communication_table(), drive_table(), channel_table(), digits_table(),
                                  adjustment_table(), sensor_temperature_table()}) {
    for (const ObjectRow& object : table) {
      EXPECT_TRUE(names.insert(object.name).second) << object.name;
      EXPECT_TRUE(indices.insert(object.index).second) << std::hex << object.index;
      std::vector<EntryRow> all = object.entries;
      all.push_back(object.zero);
      for (const EntryRow& entry : all) {
        EXPECT_THAT(std::string(entry.name), testing::Not(testing::MatchesRegex(".*[.;#=%\"$].*")));
        EXPECT_LE(entry.symbol.size(), 15U) << entry.symbol;
      }
    }
  }
}

}  // namespace
}  // namespace walkman::datasheets
