#include <fmt/format.h>

#include "drivers/can/error_report.h"
#include "drivers/robot/robot_impl.h"

namespace walkman::robot {
namespace {

using Stage = canopen::RemoteNode::Stage;

// Statusword bit 7.
constexpr std::uint16_t kWarningBit = 0x0080;

std::string describe_stage(const canopen::RemoteNode& node) {
  switch (node.stage()) {
    case Stage::kAwaitingBootUp:
      return "awaiting boot-up";
    case Stage::kConfiguring:
      return fmt::format("configuring {}/{}", node.configuration().done(), node.configuration().size());
    case Stage::kConfigured:
      return "configured";
    case Stage::kStarted:
      return "started";
    case Stage::kLost:
      return "lost by an unexpected boot-up";
    case Stage::kStopped:
      return "stopped";
  }
  return "unknown";
}

void add(Counters& sum, const BusSlot& bus) {
  const canopen::Master::Counters& counters = bus.master.counters();
  sum.frames_received += counters.received;
  sum.frames_ignored += counters.ignored;
  sum.foreign_frames += counters.foreign;
  sum.frames_not_sent += counters.not_sent;
  sum.controller_reports += counters.reports;
  sum.receive_overflows += bus.master.interface().receive_overflows();
  for (const canopen::RemoteNode* node : bus.nodes) sum.emergencies += node->emergencies();
}

}  // namespace

const std::optional<Fault>& Robot::fault() const {
  if (impl_->fault && !impl_->described) impl_->described = describe(*impl_->fault);
  return impl_->described;
}

void Robot::clear_fault() {
  impl_->fault.reset();
  impl_->described.reset();
  for (auto& bus : impl_->buses) {
    bus->master.forget_overflows();
    for (canopen::RemoteNode* node : bus->nodes) node->clear_events();
  }
}

Counters Robot::counters() const noexcept {
  Counters sum;
  sum.syncs = impl_->syncs;
  for (const auto& bus : impl_->buses) add(sum, *bus);
  return sum;
}

std::vector<BusStatus> Robot::buses() const {
  std::vector<BusStatus> list;
  for (const auto& bus : impl_->buses) {
    BusStatus status;
    status.interface = std::string(bus->master.interface().name());
    status.link = bus->master.interface().link();
    status.counters.syncs = impl_->syncs;
    add(status.counters, *bus);
    list.push_back(std::move(status));
  }
  return list;
}

std::vector<NodeStatus> Robot::nodes() const {
  std::vector<NodeStatus> list;
  for (const auto& bus : impl_->buses) {
    for (const canopen::RemoteNode* node : bus->nodes) {
      NodeStatus status;
      status.name = node->settings().name;
      status.interface = node->settings().interface;
      status.node_id = node->node_id();
      status.state = describe_stage(*node);
      if (node->stage() == Stage::kStarted && impl_->what_is_missing(*node).empty())
        status.state = "in operation";
      status.error_code = node->present_error();
      status.heartbeat_age = node->heartbeat_age(impl_->now);
      list.push_back(std::move(status));
    }
  }
  return list;
}

std::vector<std::string> Robot::warnings() const {
  std::vector<std::string> list;
  for (const auto& bus : impl_->buses) {
    const can::LinkState link = bus->master.interface().link();
    if (link == can::LinkState::kWarning || link == can::LinkState::kPassive) {
      list.push_back(fmt::format("{}: controller is {}, frames are being lost to errors on the bus",
                                 bus->master.interface().name(), can::name_of(link)));
    }
    for (const DriveSlot* slot : bus->drives) {
      const cia402::DriveSample& sample = slot->drive->sample();
      if (!slot->drive->has_samples() || (sample.statusword & kWarningBit) == 0) continue;
      list.push_back(fmt::format("{}: reports a warning (statusword {:04X}h, motor at {} degC)",
                                 slot->drive->label(), sample.statusword, sample.motor_temperature_c));
    }
  }
  return list;
}

}  // namespace walkman::robot
