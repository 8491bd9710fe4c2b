// The dictionaries of the whole robot against what the export knows.

#include <fstream>
#include <set>

#include <gtest/gtest.h>

#include "emulator/datasheets/dbc_model.h"
#include "emulator/datasheets/device_files.h"
#include "emulator/datasheets/object_names.h"
#include "emulator/emulator.h"
#include "emulator/logs/state_log.h"

namespace walkman::datasheets {
namespace {

class WholeRobot : public testing::Test {
 protected:
  static EmulatorOptions options() {
    EmulatorOptions out;
    out.actuators = std::filesystem::path(WALKMAN_SOURCE_TREE) / "emulator/plant/actuators";
    return out;
  }

  Scene scene_ = load_scene(std::filesystem::path(WALKMAN_URDF_DIR) / "scenes/experiment_1.yaml");
  RobotModel robot_ = load_robot_model(scene_.robot.urdf);
  DeviceTable table_ = load_device_table(scene_.robot.device_table, robot_);
  Emulator emulator_{robot_, table_, scene_, options()};
};

TEST_F(WholeRobot, EveryEntryOfEveryDeviceHasAName) {
  std::set<std::string> missing;
  std::size_t entries = 0;
  for (const WiredBus& bus : wired_buses(table_, emulator_.buses())) {
    for (const WiredDevice& wired : bus.devices) {
      for (const auto& entry : wired.node->dictionary().entries()) {
        ++entries;
        if (!entry_name(wired.node->dictionary(), *entry).empty()) continue;
        char text[32];
        std::snprintf(text, sizeof text, "%04Xh:%02Xh", entry->address.index, entry->address.sub);
        missing.insert(text);
      }
    }
  }
  EXPECT_GT(entries, 1000U);
  std::string list;
  for (const std::string& address : missing) list += address + ' ';
  EXPECT_TRUE(missing.empty()) << "without a name in the tables of objects: " << list;
}

TEST_F(WholeRobot, SignalNamesOfPdosInUseFitThirtyTwoCharactersAndAreUnique) {
  std::set<std::string> names;
  for (const WiredBus& bus : wired_buses(table_, emulator_.buses())) {
    for (const WiredDevice& wired : bus.devices) {
      for (const DbcMessage& message :
           pdo_messages(identifier(wired.device->name), wired.node->dictionary())) {
        for (const DbcSignal& signal : message.signals) {
          EXPECT_LE(signal.name.size(), 32U) << signal.name;
          EXPECT_TRUE(names.insert(signal.name).second) << signal.name;
        }
      }
    }
  }
  EXPECT_GT(names.size(), 300U);
}

TEST_F(WholeRobot, EveryDeviceHoldsItsOwnDataSheet) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "export_robot_test";
  const std::vector<WiredBus> buses = wired_buses(table_, emulator_.buses());
  std::set<std::string> files;
  for (const std::filesystem::path& path : write_eds_files(buses, folder)) {
    std::ifstream file(path, std::ios::binary);
    files.insert({std::istreambuf_iterator<char>(file), {}});
  }
  EXPECT_GE(files.size(), 3U);
  for (const WiredBus& bus : buses) {
    for (const WiredDevice& wired : bus.devices) {
      const nodes::Entry* sheet = wired.node->dictionary().find(0x1021, 0);
      ASSERT_NE(sheet, nullptr);
      EXPECT_EQ(files.count(sheet->text), 1U) << wired.device->name;
    }
  }
  std::filesystem::remove_all(folder);
}

TEST_F(WholeRobot, ADeviceWithoutANodeIsNamed) {
  DeviceTable changed = table_;
  changed.buses[1].devices[0].node_id = 99;
  try {
    static_cast<void>(wired_buses(changed, emulator_.buses()));
    FAIL() << "accepted";
  } catch (const std::runtime_error& e) {
    EXPECT_STREQ(e.what(), "bus rarm: no node with ID 99, expected RShSag");
  }
}

TEST(StateLog, SaysWhichFileItCannotCreate) {
  EXPECT_THROW(StateLog("/nonexistent/folder/state.csv"), std::runtime_error);
}

TEST(StateLog, BeginsWithItsNoteIfThereIsOne) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "noted_state.csv";
  for (const std::string note : {"", "INJECTED FAULTS: joint-locked of RElbj"}) {
    StateLog(file, note).flush();
    std::ifstream lines(file);
    std::string line;
    if (!note.empty()) {
      std::getline(lines, line);
      EXPECT_EQ(line, "# " + note);
    }
    std::getline(lines, line);
    EXPECT_EQ(line, "time,node,cob_id,index,sub,raw");
  }
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace walkman::datasheets
