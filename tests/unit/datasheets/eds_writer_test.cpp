#include "emulator/datasheets/eds_writer.h"

#include <gmock/gmock.h>

#include "emulator/nodes/drive/drive_node.h"
#include "emulator/nodes/measuring/force_torque_node.h"
#include "tests/unit/nodes/test_drive.h"

namespace walkman::datasheets {
namespace {

using testing::HasSubstr;
using testing::Not;

const EdsTitle kTitle{"test.eds", "Test", "T-1", "A device under test"};

std::string drives_text(const nodes::DriveParameters& a, const nodes::DriveParameters& b) {
  const nodes::DriveNode first(a);
  const nodes::DriveNode second(b);
  return eds_text(
      kTitle, std::vector<EdsDevice>{{a.node_id, &first.dictionary()}, {b.node_id, &second.dictionary()}});
}

/// Returns the lines of a section, without the CR of their line ends.
std::string section(const std::string& text, const std::string& name) {
  const std::size_t from = text.find("[" + name + "]\r\n");
  if (from == std::string::npos) return "no section " + name;
  std::string lines = text.substr(from, text.find("\r\n\r\n", from) - from + 2);
  std::erase(lines, '\r');
  return lines;
}

TEST(EdsWriter, WritesAVariable) {
  const std::string text = drives_text(nodes::test_drive(5), nodes::test_drive(6));
  EXPECT_EQ(section(text, "6060"),
            "[6060]\nParameterName=Modes of operation\nObjectType=0x7\nDataType=0x0002\nAccessType=rw\n"
            "DefaultValue=8\nPDOMapping=1\n");
  EXPECT_EQ(section(text, "1000"),
            "[1000]\nParameterName=Device type\nObjectType=0x7\nDataType=0x0007\nAccessType=ro\n"
            "DefaultValue=0x00020192\nPDOMapping=0\n");
}

TEST(EdsWriter, WritesARecordWithItsSubIndices) {
  const std::string text = drives_text(nodes::test_drive(5), nodes::test_drive(6));
  EXPECT_EQ(section(text, "607D"),
            "[607D]\nParameterName=Software position limit\nObjectType=0x8\nSubNumber=3\n");
  EXPECT_EQ(section(text, "607Dsub2"),
            "[607Dsub2]\nParameterName=Max position limit\nObjectType=0x7\nDataType=0x0004\nAccessType=rw\n"
            "DefaultValue=2000000\nPDOMapping=0\n");
}

TEST(EdsWriter, CobIdsFollowTheNodeId) {
  const std::string text = drives_text(nodes::test_drive(5), nodes::test_drive(6));
  EXPECT_THAT(section(text, "1400sub1"), HasSubstr("DefaultValue=$NODEID+0x200\n"));
  EXPECT_THAT(section(text, "1401sub1"), HasSubstr("DefaultValue=$NODEID+0x300\n"));
  EXPECT_THAT(section(text, "1014"), HasSubstr("DefaultValue=$NODEID+0x80\n"));
  EXPECT_THAT(section(text, "1200sub2"), HasSubstr("DefaultValue=$NODEID+0x580\n"));
  // TPDO3 is off (bit 31) and never sent on request (bit 30).
  EXPECT_THAT(section(text, "1802sub1"), HasSubstr("DefaultValue=$NODEID+0xC0000380\n"));
  EXPECT_THAT(section(text, "1005"), HasSubstr("DefaultValue=0x00000080\n"));
}

TEST(EdsWriter, LeavesOutWhatDiffersFromDeviceToDevice) {
  nodes::DriveParameters other = nodes::test_drive(6);
  other.rated_torque = 50;
  other.max_velocity = 3;
  const std::string same = drives_text(nodes::test_drive(5), nodes::test_drive(6));
  const std::string text = drives_text(nodes::test_drive(5), other);
  EXPECT_THAT(section(same, "6076"), HasSubstr("DefaultValue=100000\n"));
  EXPECT_THAT(section(text, "6076"), Not(HasSubstr("DefaultValue")));
  EXPECT_THAT(section(same, "607F"), HasSubstr("HighLimit=6000000\n"));
  EXPECT_THAT(section(text, "607F"), Not(HasSubstr("HighLimit")));
  EXPECT_THAT(section(text, "607F"), HasSubstr("LowLimit=1\n"));
  EXPECT_THAT(section(same, "1018sub4"), Not(HasSubstr("DefaultValue")));
  EXPECT_THAT(section(same, "6041"), Not(HasSubstr("DefaultValue")));  // process data has none
}

TEST(EdsWriter, SerialNumberIsNoPropertyOfTheType) {
  const nodes::DriveNode drive(nodes::test_drive());
  const std::string text = eds_text(kTitle, std::vector<EdsDevice>{{5, &drive.dictionary()}});
  EXPECT_THAT(section(text, "1018sub4"), Not(HasSubstr("DefaultValue")));
  EXPECT_THAT(section(text, "1018sub2"), HasSubstr("DefaultValue"));
}

// One reader expects the bits, one decimals, and one rejects the file with either.
TEST(EdsWriter, LeavesOutDefaultsOfRealValues) {
  nodes::ForceTorqueParameters parameters;
  parameters.node_id = 18;
  const nodes::ForceTorqueNode sensor(parameters);
  const std::string text = eds_text(kTitle, std::vector<EdsDevice>{{18, &sensor.dictionary()}});
  EXPECT_THAT(section(text, "6149sub1"), HasSubstr("DataType=0x0008\n"));
  EXPECT_THAT(section(text, "6149sub1"), Not(HasSubstr("DefaultValue")));
  EXPECT_THAT(section(text, "6126sub1"), Not(HasSubstr("DefaultValue")));
  EXPECT_THAT(section(text, "6139sub1"), HasSubstr("AccessType=wo\n"));
  EXPECT_THAT(section(text, "6139sub1"), Not(HasSubstr("DefaultValue")));
  EXPECT_THAT(section(text, "Comments"), Not(HasSubstr("607Ah")));
}

// A master that binds 6040h to the last PDO that maps it must find only the one that is enabled.
TEST(EdsWriter, PdosThatAreOffMapNothing) {
  const std::string text = drives_text(nodes::test_drive(5), nodes::test_drive(6));
  for (const char* off : {"1602", "1603", "1A02"}) {
    EXPECT_THAT(section(text, off + std::string("sub0")), HasSubstr("DefaultValue=0\n"));
    EXPECT_THAT(section(text, off + std::string("sub1")), HasSubstr("DefaultValue=0x00000000\n"));
  }
}

TEST(EdsWriter, SaysHowAFirstTargetIsSet) {
  const std::string text = drives_text(nodes::test_drive(5), nodes::test_drive(6));
  EXPECT_THAT(section(text, "Comments"), HasSubstr("read 6064h first and write it to 607Ah"));
}

TEST(EdsWriter, RefusesDevicesOfDifferentTypes) {
  const nodes::DriveNode drive(nodes::test_drive());
  nodes::ForceTorqueParameters parameters;
  parameters.node_id = 18;
  const nodes::ForceTorqueNode sensor(parameters);
  const std::vector<EdsDevice> devices{{5, &drive.dictionary()}, {18, &sensor.dictionary()}};
  EXPECT_THROW(static_cast<void>(eds_text(kTitle, devices)), std::runtime_error);
}

}  // namespace
}  // namespace walkman::datasheets
