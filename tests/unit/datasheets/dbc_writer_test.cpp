#include "emulator/datasheets/dbc_writer.h"

#include <gmock/gmock.h>

#include "emulator/nodes/drive/drive_node.h"
#include "emulator/nodes/measuring/force_torque_node.h"
#include "emulator/nodes/measuring/measuring_table.h"
#include "tests/unit/nodes/test_drive.h"

namespace walkman::datasheets {
namespace {

using testing::HasSubstr;
using testing::Not;

std::string bus_of(const std::string& name, std::uint8_t node_id, const nodes::ObjectDictionary& dictionary) {
  return dbc_text("rarm", {{name, node_id, "Node", &dictionary}});
}

// Node-ID 5, rated 100 N·m: one per mille is 0.1 N·m. 205h = 517, 185h = 389.
TEST(DbcWriter, WritesTheFactoryMappingOfADrive) {
  const nodes::DriveNode drive(nodes::test_drive());
  const std::string text = bus_of("RShLat", 5, drive.dictionary());
  EXPECT_THAT(text, HasSubstr("BU_: computer RShLat\n"));
  EXPECT_THAT(text,
              HasSubstr("BO_ 517 RShLat_RPDO1: 5 computer\n"
                        " SG_ RShLat_controlword : 0|16@1+ (1,0) [0|65535] \"\" RShLat\n"
                        " SG_ RShLat_mode : 16|8@1- (1,0) [-128|127] \"\" RShLat\n"
                        " SG_ RShLat_target_torque : 24|16@1- (0.1,0) [-3276.8|3276.7] \"Nm\" RShLat\n\n"));
  EXPECT_THAT(text,
              HasSubstr("BO_ 645 RShLat_TPDO2: 8 RShLat\n"
                        " SG_ RShLat_position_actual : 0|32@1- (0.000001,0) [-2147.483648|2147.483647] "
                        "\"rad\" computer\n"
                        " SG_ RShLat_velocity_actual : 32|32@1- (0.000001,0) [-2147.483648|2147.483647] "
                        "\"rad/s\" computer\n\n"));
  EXPECT_THAT(text, HasSubstr("CM_ SG_ 389 RShLat_statusword \"6041h:00h Statusword\";\n"));
  EXPECT_THAT(text, HasSubstr("BA_ \"ObjectIndex\" SG_ 389 RShLat_statusword 24641;\n"));
  EXPECT_THAT(text, HasSubstr("VAL_ 389 RShLat_mode_display -1 \"impedance\" 0 \"no mode\""));
}

TEST(DbcWriter, WritesTheOtherServices) {
  const nodes::DriveNode drive(nodes::test_drive());
  const std::string text = bus_of("RShLat", 5, drive.dictionary());
  EXPECT_THAT(text, HasSubstr("BO_ 0 NMT: 2 computer\n"));
  EXPECT_THAT(text, HasSubstr("BO_ 128 SYNC: 0 computer\n"));
  EXPECT_THAT(text, HasSubstr("BO_ 133 RShLat_EMCY: 8 RShLat\n SG_ RShLat_emcy_code : 0|16@1+"));
  EXPECT_THAT(text, HasSubstr("BO_ 1413 RShLat_SDO_response: 8 RShLat\n"));
  EXPECT_THAT(text, HasSubstr("BO_ 1541 RShLat_SDO_request: 8 computer\n"));
  EXPECT_THAT(text, HasSubstr("BO_ 1797 RShLat_heartbeat: 1 RShLat\n"));
}

TEST(DbcWriter, LeavesOutWhatIsOff) {
  const nodes::DriveNode drive(nodes::test_drive());
  const std::string text = bus_of("RShLat", 5, drive.dictionary());
  EXPECT_THAT(text, HasSubstr("RShLat_RPDO2"));
  EXPECT_THAT(text, Not(HasSubstr("RShLat_RPDO3")));
  EXPECT_THAT(text, Not(HasSubstr("RShLat_RPDO4")));
  EXPECT_THAT(text, Not(HasSubstr("RShLat_TPDO3")));
}

TEST(DbcWriter, WritesASensorInItsOwnUnits) {
  nodes::ForceTorqueParameters parameters;
  parameters.node_id = 18;
  const nodes::ForceTorqueNode sensor(parameters);
  const std::string text = bus_of("r_arm_ft", 18, sensor.dictionary());
  EXPECT_THAT(text, HasSubstr("BO_ 402 r_arm_ft_TPDO1: 8 r_arm_ft\n"
                              " SG_ r_arm_ft_pv_Fx : 0|16@1- (0.1,0) [-3276.8|3276.7] \"N\" computer\n"));
  EXPECT_THAT(text, HasSubstr(" SG_ r_arm_ft_pv_Tz : 32|16@1- (0.01,0) [-327.68|327.67] \"Nm\" computer\n"));
  EXPECT_THAT(text, Not(HasSubstr("r_arm_ft_RPDO")));  // no RPDO is mapped
}

TEST(DbcWriter, TakesTheMappingOfTheMoment) {
  using namespace nodes;
  const auto count_of = [](std::uint8_t n) { return read_write<std::uint8_t>("Number", n); };
  const auto mapping = [&](std::uint16_t index, std::uint8_t n, std::vector<EntryRow> entries) {
    ObjectRow row = record(index, "Mapping", std::move(entries));
    row.zero = count_of(n);
    return row;
  };
  ObjectDictionary d;
  d.add(record(0x1800, "TPDO",
               {read_write<std::uint32_t>("COB-ID", 0x40000185), read_write<std::uint8_t>("Type", 4)}));
  d.add(mapping(0x1A00, 0, {read_write<std::uint32_t>("Mapped", 0x61300120)}));
  d.add(array_of(0x6130, "AI input PV", read_only<float>(kChannelName).pdo(), 1));
  d.add(record(0x1400, "RPDO",
               {read_write<std::uint32_t>("COB-ID", 0x205), read_write<std::uint8_t>("Type", 255)}));
  d.add(mapping(0x1600, 2,
                {read_write<std::uint32_t>("Mapped", 0x00060010),  // 16 bits for another device
                 read_write<std::uint32_t>("Mapped", 0x60400010)}));
  d.add(variable(0x6040, read_write<std::uint16_t>("Controlword").pdo()));
  auto count = d.object<std::uint8_t>(0x1A00);
  EXPECT_THAT(bus_of("a", 5, d), Not(HasSubstr("a_TPDO1")));
  count.set(1);
  const std::string text = bus_of("a", 5, d);
  EXPECT_THAT(
      text,
      HasSubstr("BO_ 389 a_TPDO1: 4 a\n SG_ a_ai_input_pv_Channel_1 : 0|32@1- (1,0) [0|0] \"\" computer\n"));
  EXPECT_THAT(text, HasSubstr("SIG_VALTYPE_ 389 a_ai_input_pv_Channel_1 : 1;\n"));
  EXPECT_THAT(text, HasSubstr("CM_ BO_ 389 \"TPDO1 of a, every 4 SYNCs\";\n"));
  EXPECT_THAT(text, HasSubstr("BO_ 517 a_RPDO1: 4 computer\n SG_ a_controlword : 16|16@1+"));
}

TEST(DbcWriter, MakesIdentifiersOfAnyName) {
  const nodes::DriveNode drive(nodes::test_drive());
  const std::string text = bus_of("1st/arm \"q\"", 5, drive.dictionary());
  EXPECT_THAT(text, HasSubstr("BO_ 517 _1st_arm__q__RPDO1: 5 computer\n"));
  EXPECT_EQ(text.find_first_not_of("\n !\"#$%&'()*+,-./0123456789:;<=>?@ABCDEFGHIJKLMNOPQRSTUVWXYZ[\\]^_`"
                                   "abcdefghijklmnopqrstuvwxyz{|}~"),
            std::string::npos);
}

}  // namespace
}  // namespace walkman::datasheets
