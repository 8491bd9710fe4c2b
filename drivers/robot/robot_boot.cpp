#include <stdexcept>

#include <fmt/format.h>

#include "drivers/cia402/power_up.h"
#include "drivers/robot/robot_impl.h"

namespace walkman::robot {
namespace {

using Stage = canopen::RemoteNode::Stage;

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
  }
  return "unknown";
}

}  // namespace

void Robot::Impl::begin_boot(Time at) {
  phase = Phase::kResetting;
  phase_began = at;
  fault.reset();
  described.reset();
  for (auto& bus : buses) {
    bus->commanded = false;
    bus->master.discard();
    for (canopen::RemoteNode* node : bus->nodes) node->begin_boot(at);
  }
}

bool Robot::Impl::command_all(canopen::NmtCommand command) noexcept {
  bool all = true;
  for (auto& bus : buses) {
    if (!bus->commanded) bus->commanded = bus->master.nmt(command);
    all = all && bus->commanded;
  }
  return all;
}

bool Robot::Impl::configure_all(Time at) {
  bool all = true;
  for (auto& bus : buses) {
    for (canopen::RemoteNode* node : bus->nodes) all = node->configure(at) && all;
  }
  return all;
}

bool Robot::Impl::power_up_all() {
  bool all = true;
  for (auto& bus : buses) {
    for (const canopen::RemoteNode* node : bus->nodes) {
      if (node->stage() == Stage::kLost) {
        throw std::runtime_error(node->label() + ": booted up again after NMT start");
      }
      all = all && node->nmt_state() == canopen::NmtState::kOperational;
    }
    for (DriveSlot* slot : bus->drives) {
      // Every look at the statusword chooses a controlword, so only when the next one is about to be sent.
      if (turn_of(*slot->drive)) slot->drive->power_up();
      all = all && slot->drive->powered_up();
    }
  }
  for (const auto& sensor : force_torque) all = all && sensor->has_sample();
  return all;
}

std::string Robot::Impl::what_is_missing(const canopen::RemoteNode& node) const {
  if (node.stage() == Stage::kAwaitingBootUp) return "no boot-up message";
  if (node.stage() == Stage::kConfiguring) {
    return fmt::format("configuration at step {} of {}", node.configuration().done() + 1,
                       node.configuration().size());
  }
  if (node.stage() != Stage::kStarted) return {};
  for (const auto& sensor : force_torque) {
    if (sensor.get() == &node && !sensor->has_sample()) return "no complete sample (TPDO1 and TPDO2)";
  }
  for (const auto* drives : {&joint_drives, &hand_drives}) {
    for (const auto& slot : *drives) {
      const cia402::JointDrive& drive = *slot->drive;
      if (&drive != &node) continue;
      if (!drive.has_samples()) return "no TPDO1 and TPDO2";
      if (drive.state() != cia402::State::kOperationEnabled) {
        return fmt::format(
            "stays in state {} (statusword {:04X}h, error code {:04X}h), not operation enabled",
            cia402::name_of(drive.state()), drive.sample().statusword, drive.sample().error_code);
      }
      if (!drive.powered_up())
        return fmt::format("mode of operation (6061h) is {}, not 8", drive.sample().mode);
    }
  }
  if (node.nmt_state() != canopen::NmtState::kOperational) return "no heartbeat with state operational";
  return {};
}

void Robot::Impl::check_boot_progress(Time at) const {
  for (const auto& bus : buses) {
    if (bus->master.interface_down()) {
      throw std::runtime_error(std::string(bus->master.interface().name()) +
                               ": interface is down, nothing can be sent");
    }
  }
  if (at - phase_began < options.boot_timeout) return;
  const auto limit = std::chrono::duration_cast<std::chrono::milliseconds>(options.boot_timeout).count();
  for (const auto& bus : buses) {
    if (!bus->commanded) {
      throw std::runtime_error(fmt::format("{}: transmit queue did not take an NMT command within {} ms",
                                           bus->master.interface().name(), limit));
    }
    for (const canopen::RemoteNode* node : bus->nodes) {
      const std::string missing = what_is_missing(*node);
      if (missing.empty()) continue;
      throw std::runtime_error(fmt::format("{}: {} within {} ms", node->label(), missing, limit));
    }
  }
  throw std::runtime_error(fmt::format("robot: not booted within {} ms", limit));
}

bool Robot::Impl::boot(Time at) {
  now = at;
  if (phase == Phase::kRunning && !fault) return true;
  if (phase == Phase::kRunning || phase == Phase::kIdle || phase == Phase::kStopped) begin_boot(at);
  receive(at);
  check_boot_progress(at);
  if (phase == Phase::kResetting && command_all(canopen::NmtCommand::kResetCommunication)) {
    phase = Phase::kConfiguring;
  } else if (phase == Phase::kConfiguring && configure_all(at)) {
    phase = Phase::kStarting;
    for (auto& bus : buses) bus->commanded = false;
  } else if (phase == Phase::kPoweringUp && power_up_all()) {
    phase = Phase::kRunning;
    for (auto* drives : {&joint_drives, &hand_drives}) {
      for (auto& slot : *drives) slot->set_point.hold(slot->drive->target());
    }
    for (auto& bus : buses) {
      for (canopen::RemoteNode* node : bus->nodes) node->clear_events();
    }
    take_states(at);
    return true;
  }
  if (phase == Phase::kStarting && command_all(canopen::NmtCommand::kStart)) {
    phase = Phase::kPoweringUp;
    for (auto& bus : buses) {
      for (canopen::RemoteNode* node : bus->nodes) node->start(at);
    }
  }
  send_cycle(at);
  return false;
}

std::vector<NodeStatus> Robot::nodes() const {
  std::vector<NodeStatus> list;
  for (const auto& bus : impl_->buses) {
    for (const canopen::RemoteNode* node : bus->nodes) {
      std::string state = describe_stage(*node);
      if (node->stage() == Stage::kStarted) {
        const auto missing = impl_->what_is_missing(*node);
        if (missing.empty()) state = "in operation";
      }
      list.push_back({node->settings().name, node->settings().interface, node->node_id(), std::move(state)});
    }
  }
  return list;
}

}  // namespace walkman::robot
