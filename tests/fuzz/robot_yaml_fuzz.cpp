// The files that describe the robot to its own computer, each read as every kind of them: description, device
// table, identities, PDO layout.

#include <set>

#include "drivers/robot/identities.h"
#include "drivers/robot/pdo_layout.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/input_file.h"
#include "urdf/reader/robot_description.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  static const RobotModel robot = load_robot_model(WALKMAN_SOURCE_TREE "/urdf/walkman.urdf");
  static fuzz::InputFile file("urdf/input.yaml", WALKMAN_SOURCE_TREE);
  file.write({data, size});
  file.read_or_refuse([] {
    const RobotDescription description = load_robot_description(file.path());
    fuzz::require(!description.urdf.empty() && !description.device_table.empty(),
                  "a robot has a URDF and devices");
  });
  file.read_or_refuse([] {
    std::set<int> nodes;
    for (const Bus& bus : load_device_table(file.path(), robot).buses) {
      fuzz::require(!interface_name_problem(bus.interface), "an interface may have its name");
      for (const Device& device : bus.devices)
        fuzz::require(device.node_id >= 1 && device.node_id <= 126 && nodes.insert(device.node_id).second,
                      "a node-ID is in range and used once");
    }
  });
  file.read_or_refuse([] { static_cast<void>(robot::load_identities(file.path())); });
  file.read_or_refuse([] { static_cast<void>(robot::load_pdo_layout(file.path())); });
  return 0;
}
