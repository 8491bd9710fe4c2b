#include <filesystem>
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/unit/drivers/layout_rig.h"

namespace walkman::test {
namespace {

using canopen::DevicePdos;
using canopen::PdoSettings;
using ::testing::HasSubstr;

std::string text_of_file(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

/// Writes `text` to a file and passes it to `load`; returns the error message.
template <typename Load>
std::string error_of(const std::string& text, Load load) {
  const auto file =
      std::filesystem::path(::testing::TempDir()) / (std::to_string(getpid()) + "_under_test.yaml");
  std::ofstream(file) << text;
  try {
    load(file);
    return "loaded";
  } catch (const std::runtime_error& error) {
    const std::string what = error.what();
    const auto end = what.find("under_test.yaml:");
    return end == std::string::npos ? what : what.substr(end + 16);
  }
}

std::string layout_error(const std::string& text) {
  return error_of(text, [](const auto& file) { static_cast<void>(robot::load_pdo_layout(file)); });
}

/// Returns layout `letter` with the first `from` after `after` replaced by `to`.
std::string changed(const std::string& letter, const std::string& after, const std::string& from,
                    const std::string& to) {
  std::string text = text_of_file(layout_file(letter));
  const auto start = text.find(after);
  EXPECT_NE(start, std::string::npos) << after;
  const auto at = text.find(from, start);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::vector<std::uint32_t> entries(const PdoSettings& pdo) {
  std::vector<std::uint32_t> all;
  for (const auto& object : pdo.mapping) all.push_back(object.entry());
  return all;
}

void expect_same(const DevicePdos& loaded, const DevicePdos& factory) {
  for (std::size_t i = 0; i < 4; ++i) {
    for (const auto& [a, b] : {std::pair{&loaded.receive[i], &factory.receive[i]},
                               std::pair{&loaded.transmit[i], &factory.transmit[i]}}) {
      EXPECT_EQ(a->enabled, b->enabled) << i;
      if (!a->enabled) continue;
      EXPECT_EQ(a->cob_id_base, b->cob_id_base) << i;
      EXPECT_EQ(a->type, b->type) << i;
      EXPECT_EQ(a->event_ms, b->event_ms) << i;
      EXPECT_EQ(entries(*a), entries(*b)) << i;
    }
  }
}

TEST(LayoutFiles, LayoutAIsTheFactoryMapping) {
  const robot::PdoLayout a = robot::load_pdo_layout(layout_file("a"));
  const robot::PdoLayout factory = robot::factory_layout();
  EXPECT_EQ(a.name, "A");
  EXPECT_FALSE(a.fd);
  for (const DeviceKind kind : {DeviceKind::kJointDrive, DeviceKind::kHandDrive, DeviceKind::kForceTorque,
                                DeviceKind::kInertialUnit}) {
    expect_same(a.of(kind), factory.of(kind));
    EXPECT_TRUE(a.of(kind).write_transmit);
    EXPECT_FALSE(factory.of(kind).write_transmit);
  }
}

// Against the table in docs/protocol.md.
TEST(LayoutFiles, MappingsAreThoseOfTheTable) {
  const robot::PdoLayout b = robot::load_pdo_layout(layout_file("b"));
  const robot::PdoLayout c = robot::load_pdo_layout(layout_file("c"));
  const robot::PdoLayout d = robot::load_pdo_layout(layout_file("d"));
  const std::vector<std::uint32_t> command{0x60400010, 0x607A0020, 0x60B20010};
  const std::vector<std::uint32_t> status{0x60410010, 0x60640020, 0x60770010};
  for (const auto* layout : {&b, &c}) {
    EXPECT_EQ(entries(layout->of(DeviceKind::kJointDrive).receive[3]), command);
    EXPECT_EQ(layout->of(DeviceKind::kJointDrive).receive[3].cob_id_base, 0x500U);
    EXPECT_EQ(entries(layout->of(DeviceKind::kJointDrive).transmit[0]), status);
    EXPECT_FALSE(layout->of(DeviceKind::kJointDrive).receive[0].enabled);
    EXPECT_FALSE(layout->of(DeviceKind::kJointDrive).receive[1].enabled);
  }
  EXPECT_EQ(entries(b.of(DeviceKind::kJointDrive).transmit[1]),
            (std::vector<std::uint32_t>{0x60640020, 0x606C0020}));
  EXPECT_FALSE(c.of(DeviceKind::kJointDrive).transmit[1].enabled);
  EXPECT_TRUE(d.fd);
  EXPECT_EQ(entries(d.of(DeviceKind::kJointDrive).receive[0]),
            (std::vector<std::uint32_t>{0x60400010, 0x60600008, 0x607A0020, 0x60FF0020, 0x60B20010,
                                        0x20110110, 0x20110210}));
  EXPECT_EQ(entries(d.of(DeviceKind::kJointDrive).transmit[0]),
            (std::vector<std::uint32_t>{0x60410010, 0x60610008, 0x60640020, 0x606C0020, 0x60770010,
                                        0x60E40120, 0x20200220}));
  EXPECT_EQ(d.of(DeviceKind::kJointDrive).receive[0].bytes(), 17U);
  EXPECT_EQ(d.of(DeviceKind::kJointDrive).transmit[0].bytes(), 21U);
  EXPECT_EQ(d.of(DeviceKind::kForceTorque).transmit[0].bytes(), 15U);
  for (const auto* layout : {&b, &c, &d}) {
    for (const auto* pdos :
         {&layout->of(DeviceKind::kHandDrive).receive, &layout->of(DeviceKind::kHandDrive).transmit}) {
      for (const PdoSettings& pdo : *pdos) {
        EXPECT_TRUE(!pdo.cyclic() || pdo.type == (layout == &b ? 1 : 4));
      }
    }
  }
}

struct BadFile {
  const char* layout;
  const char* after;
  const char* from;
  const char* to;
  const char* sentence;
};

TEST(LayoutFiles, WhatIsWrongIsNamedWithLineAndPlace) {
  const BadFile cases[] = {
      {"a", "name:", "can_fd: no", "can_fd: perhaps", "9: can_fd: found \"perhaps\", expected yes or no"},
      {"a",
       "name:", "joint_drive:", "joint_drives:", "joint_drives: unknown key; did you mean \"joint_drive\"?"},
      {"a", "joint_drive:", "number: 1", "number: 5",
       "joint_drive.rpdos[0].number: found \"5\", expected a whole number from 1 to 4"},
      {"a", "joint_drive:", "number: 2", "number: 1", "joint_drive.rpdos[1].number: PDO 1 already exists"},
      {"a", "joint_drive:", "0x300", "0x200",
       "joint_drive.rpdos[1].cob_id_base: 0x200 is already used by PDO 1"},
      {"a", "joint_drive:", "0x300", "0x280",
       "cob_id_base: found 0x280, expected 0x200, 0x300, 0x400 or 0x500"},
      {"a", "joint_drive:", "0x300", "768",
       "cob_id_base: found \"768\", expected a hexadecimal number from 0x0 to 0x7FF"},
      {"a", "joint_drive:", "type: 255", "type: 241", "type: found 241, expected 0 to 240, 254 or 255"},
      {"a", "joint_drive:", "type: 255", "type: 253", "type: found 253, expected 0 to 240, 254 or 255"},
      {"a", "joint_drive:", "type: 1", "type: 2",
       "joint_drive: PDOs have transmission types 2 and 1, expected the same for all cyclic PDOs"},
      {"a", "joint_drive:", "bits: 16", "bits: 12", "bits: found 12, expected 8, 16, 32 or 64"},
      {"a", "joint_drive:", "bits: 16", "bits: 8",
       "joint_drive: 6040h:0 (controlword) is mapped with 8 bits, expected 16"},
      {"a", "joint_drive:", "0x6040", "0x60G0", "index: found \"0x60G0\", expected a hexadecimal number"},
      {"a", "joint_drive:", "0x6040", "0x0009", "0009h:0 cannot be mapped here"},
      {"a", "joint_drive:", "0x6040", "0x0005", "bits: found 16, dummy 0005h has 8"},
      {"a", "tpdos", "0x6041", "0x0006", "0006h:0 cannot be mapped here"},
      {"a", "joint_drive:", "0x607A", "0x607C", "joint_drive: no RPDO carries 607Ah:0 (target position)"},
      {"a", "tpdos", "0x6064", "0x6062", "joint_drive: no TPDO carries 6064h:0 (position)"},
      {"a", "tpdos", "type: 1", "type: 255",
       "joint_drive: 6041h:0 (statusword) is in no TPDO of transmission type 1 to 240"},
      {"a", "joint_drive:", "{index: 0x6071, bits: 16}", "{index: 0x6071, bits: 64}",
       "objects: 11 bytes in all, expected at most 8 in a classical frame"},
      {"a", "force_torque:", "sub: 6", "sub: 5",
       "force_torque: 7130h:5 with 16 bits is in several TPDOs of transmission type 1 to 240, expected one"},
      {"a", "imu:", "0x6150", "0x6151",
       "imu: 6150h:1 with 8 bits is in no TPDOs of transmission type 1 to 240, expected one"},
      {"a", "force_torque:", "  tpdos:", "  rpdos: []\n  tpdos:", "force_torque.rpdos: unknown key"},
      {"a", "tpdos", "event_ms: 100", "inhibit_us: 150", "inhibit_us: found 150, expected a multiple of 100"},
      {"a", "tpdos", "event_ms: 100", "event_ms: 70000",
       "event_ms: found \"70000\", expected a whole number"},
      {"e", "joint_drive:", "{index: 0x2052, bits: 16}", "{index: 0x2052, bits: 8}",
       "objects: found 2052h:0 (protection) with 8 bits in place 3 of 3, expected it last, with 16 bits"},
      {"e", "joint_drive:", "0x6040", "0x2052",
       "objects: found 2052h:0 (protection) with 16 bits in place 1 of 3"},
      {"d", "name:", "can_fd: yes", "can_fd: no",
       "objects: 17 bytes in all, expected at most 8 in a classical"},
  };
  for (const BadFile& bad : cases) {
    EXPECT_THAT(layout_error(changed(bad.layout, bad.after, bad.from, bad.to)), HasSubstr(bad.sentence))
        << bad.to;
  }
  EXPECT_THAT(layout_error("name: A\ncan_fd: no\n"), HasSubstr("the key \"joint_drive\" is missing"));
  EXPECT_THAT(layout_error("- 1\n"), HasSubstr("found a list of 1, expected a mapping"));
  EXPECT_THAT(layout_error("name: [\n"), HasSubstr("not well-formed YAML"));
}

TEST(IdentityFile, ShippedOneIsComplete) {
  const robot::Identities identities =
      robot::load_identities(std::string(WALKMAN_URDF_DIR) + "/walkman.identities.yaml");
  const canopen::ExpectedIdentity drive = identities.of(DeviceKind::kJointDrive, 11);
  EXPECT_EQ(drive.device_type, 0x00020192U);
  EXPECT_EQ(drive.vendor, 0x4B4C4157U);
  EXPECT_EQ(drive.revision, 0x00010000U);
  EXPECT_FALSE(drive.serial);
  EXPECT_EQ(identities.of(DeviceKind::kForceTorque, 18).device_type, 0x00020194U);
}

TEST(IdentityFile, WhatIsWrongIsNamed) {
  const auto error = [](const std::string& text) {
    return error_of(text, [](const auto& file) { static_cast<void>(robot::load_identities(file)); });
  };
  EXPECT_EQ(error("imu: {device_type: 0x00020194}\nserials: [{node: 11, serial: 0xB}]\n"), "loaded");
  EXPECT_THAT(error("imu: {vendor: 0x1}\n"), HasSubstr("1: imu: the key \"device_type\" is missing"));
  EXPECT_THAT(
      error("imu: {device_type: 131476}\n"),
      HasSubstr("imu.device_type: found \"131476\", expected a hexadecimal number from 0x1 to 0xFFFFFFFF"));
  EXPECT_THAT(error("imu: {device_type: 0x1FFFFFFFF}\n"), HasSubstr("expected a hexadecimal number"));
  EXPECT_THAT(error("serials: [{node: 11, serial: 0x1}, {node: 11, serial: 0x2}]\n"),
              HasSubstr("serials[1].node: node 11 already has a serial number"));
  EXPECT_THAT(error("serials: [{node: 128, serial: 0x1}]\n"),
              HasSubstr("expected a whole number from 1 to 127"));
}

}  // namespace
}  // namespace walkman::test
