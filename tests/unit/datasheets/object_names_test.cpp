#include "emulator/datasheets/object_names.h"

#include <set>

#include <gmock/gmock.h>

#include "emulator/nodes/drive/drive_node.h"
#include "emulator/nodes/measuring/force_torque_node.h"
#include "emulator/nodes/measuring/inertial_node.h"
#include "tests/unit/nodes/test_drive.h"

namespace walkman::datasheets {
namespace {

using nodes::ObjectAddress;

TEST(ObjectNames, AreThoseOfTheStandards) {
  const nodes::DriveNode drive(nodes::test_drive());
  const auto name = [&](std::uint16_t index, std::uint8_t sub) {
    return entry_name(drive.dictionary(), {index, sub});
  };
  EXPECT_EQ(name(0x1000, 0), "Device type");
  EXPECT_EQ(name(0x1018, 0), "Highest sub-index supported");
  EXPECT_EQ(name(0x1018, 4), "Serial number");
  EXPECT_EQ(name(0x1003, 0), "Number of errors");
  EXPECT_EQ(object_name(0x1402), "RPDO 3 communication parameter");
  EXPECT_EQ(name(0x1402, 5), "Event timer");
  EXPECT_EQ(object_name(0x1A00), "TPDO 1 mapping parameter");
  EXPECT_EQ(name(0x1A00, 8), "Mapped object 8");
  EXPECT_EQ(name(0x6041, 0), "Statusword");
  EXPECT_EQ(name(0x607D, 2), "Max position limit");
  EXPECT_EQ(entry_symbol(drive.dictionary(), {0x6064, 0}), "position_actual");
}

TEST(ObjectNames, ChannelsAreCalledAfterWhatTheyMeasure) {
  nodes::ForceTorqueParameters parameters;
  parameters.node_id = 18;
  const nodes::ForceTorqueNode sensor(parameters);
  EXPECT_EQ(entry_name(sensor.dictionary(), {0x7130, 1}), "Fx");
  EXPECT_EQ(entry_name(sensor.dictionary(), {0x7130, 6}), "Tz");
  EXPECT_EQ(entry_symbol(sensor.dictionary(), {0x7130, 5}), "pv_Ty");
}

TEST(ObjectNames, ChannelsOfAnInertialUnit) {
  nodes::InertialParameters parameters;
  parameters.node_id = 91;
  const nodes::InertialNode unit(parameters);
  EXPECT_EQ(entry_name(unit.dictionary(), {0x7130, 3}), "az");
  EXPECT_EQ(entry_name(unit.dictionary(), {0x7130, 4}), "wx");
  EXPECT_EQ(entry_name(unit.dictionary(), {0x7130, 7}), "qw");
  EXPECT_EQ(entry_name(unit.dictionary(), {0x7130, 10}), "qz");
  EXPECT_DOUBLE_EQ(wire_unit(unit.dictionary(), {0x7130, 10}).factor, 1.0 / 30000);
  EXPECT_DOUBLE_EQ(wire_unit(unit.dictionary(), {0x6130, 10}).factor, 1);
}

TEST(ObjectNames, SayWhatIsUnknown) {
  const nodes::ObjectDictionary empty;
  EXPECT_FALSE(is_named({0x5FFF, 0}));
  EXPECT_FALSE(is_named({0x6041, 1}));
  EXPECT_FALSE(is_named({0x1018, 5}));
  EXPECT_TRUE(is_named({0x1018, 0}));
  EXPECT_EQ(entry_name(empty, {0x5FFF, 0}), "Object 5FFFh");
  EXPECT_EQ(entry_symbol(empty, {0x5FFF, 2}), "object_5FFF_2");
}

TEST(ObjectNames, AreUniqueAndFitAnEds) {
  std::set<std::string_view> names;
  std::set<std::uint16_t> indices;
  for (const auto table : {communication_names(), manufacturer_names(), drive_names(), measuring_names()}) {
    for (const ObjectName& object : table) {
      EXPECT_TRUE(names.insert(object.self.name).second) << object.self.name;
      EXPECT_TRUE(indices.insert(object.first).second) << std::hex << object.first;
      std::vector<SubName> all = object.subs;
      all.push_back(object.self);
      for (const SubName& sub : all) {
        EXPECT_THAT(std::string(sub.name), testing::Not(testing::MatchesRegex(".*[.;#=%\"$].*")));
        EXPECT_LE(sub.symbol.size(), 15U) << sub.symbol;
      }
    }
  }
}

}  // namespace
}  // namespace walkman::datasheets
