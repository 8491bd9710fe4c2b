// Frames into a force/torque sensor or an inertial unit, in any order, while they sample.

#include "emulator/nodes/measuring/force_torque_node.h"
#include "emulator/nodes/measuring/inertial_node.h"
#include "tests/fuzz/node_talk.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  fuzz::Input input(data, size);
  const unsigned how = input.byte();
  const bool fd = (how & 7U) == 7;  // takes ten times as long to set up
  if ((how & 8U) != 0) {
    nodes::InertialParameters parameters;
    parameters.node_id = 5;
    parameters.name = "imu_link";
    parameters.serial = 5;
    nodes::InertialNode unit(parameters);
    if (fd) unit.use_fd();
    nodes::InertialReadings readings;
    fuzz::talk_to(unit, input, fd, [&](Time pause) {
      readings.specific_force_S.x() = static_cast<double>(pause.count() % 7919) - 4000;
      unit.sample(readings);
    });
    return 0;
  }
  nodes::ForceTorqueParameters parameters;
  parameters.node_id = 5;
  parameters.name = "r_arm_ft";
  parameters.serial = 5;
  nodes::ForceTorqueNode sensor(parameters);
  if (fd) sensor.use_fd();
  Wrench F_So_S;
  fuzz::talk_to(sensor, input, fd, [&](Time pause) {
    F_So_S.force.z() = static_cast<double>(pause.count() % 7919) - 4000;
    sensor.sample(F_So_S);
  });
  return 0;
}
