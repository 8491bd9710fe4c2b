#include "drivers/robot/fault.h"

#include "drivers/canopen/remote_node.h"

namespace walkman::robot {

Fault describe(const FaultRecord& record) {
  Fault fault;
  fault.kind = canopen::kind_of(record.cause);
  fault.time = record.time;
  std::string who = "robot";
  if (record.device != nullptr) {
    fault.device = record.device->settings().name;
    fault.node_id = record.device->node_id();
    who = record.device->label();
  } else if (record.interface != nullptr) {
    who = fault.device = std::string(record.interface->name());
  }
  fault.text = who + ": " + canopen::sentence(record.cause);
  return fault;
}

}  // namespace walkman::robot
