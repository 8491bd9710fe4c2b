#include <stdexcept>

#include <fmt/format.h>

#include "drivers/cia402/power_up.h"
#include "drivers/robot/robot_impl.h"

namespace walkman::robot {

using Stage = canopen::RemoteNode::Stage;

void Robot::Impl::begin_reset(BusSlot& bus, Time at) {
  bus.commanded = false;
  bus.reset = bus.power_up = true;
  bus.master.discard();
  bus.master.restart_sync_counter();
  for (canopen::RemoteNode* node : bus.nodes) node->begin_boot(at);
}

void Robot::Impl::begin_boot(Time at) {
  phase = Phase::kResetting;
  phase_began = at;
  recovering = false;
  fault.reset();
  described.reset();
  for (auto& bus : buses) begin_reset(*bus, at);
}

bool Robot::Impl::command_all(canopen::NmtCommand command) noexcept {
  bool all = true;
  for (auto& bus : buses) {
    if (!bus->reset) continue;
    if (!bus->commanded) {
      bus->commanded = bus->master.nmt(command);
      if (bus->commanded && command == canopen::NmtCommand::kResetCommunication) {
        for (canopen::RemoteNode* node : bus->nodes) node->reset_sent();
      }
    }
    all = all && bus->commanded;
  }
  return all;
}

bool Robot::Impl::configure_all(Time at) {
  bool all = true;
  for (auto& bus : buses) {
    if (!bus->reset) continue;
    for (canopen::RemoteNode* node : bus->nodes) all = node->configure(at) && all;
  }
  return all;
}

void Robot::Impl::begin_power_up() noexcept {
  phase = Phase::kPoweringUp;
  for (auto& bus : buses) {
    if (!bus->power_up) continue;
    for (DriveSlot* slot : bus->drives) slot->drive->begin_power_up();
  }
}

bool Robot::Impl::power_up_all() {
  bool all = true;
  for (auto& bus : buses) {
    if (!bus->power_up) continue;
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
    for (const ft::ForceTorqueSensor* sensor : bus->sensors) all = all && sensor->has_sample();
    for (const imu::InertialUnit* unit : bus->imus) all = all && unit->has_sample();
  }
  return all;
}

std::string Robot::Impl::what_is_missing(const canopen::RemoteNode& node) const {
  if (node.stage() == Stage::kAwaitingBootUp) return "no boot-up message";
  if (node.stage() == Stage::kConfiguring) {
    return fmt::format("configuration at step {} of {}", node.configuration().done() + 1,
                       node.configuration().size());
  }
  if (node.stage() != Stage::kStarted) return {};
  for (int number = 1; number <= 4; ++number) {
    if (node.sync_divider(number) != 0 && node.tpdo_at(number) == Time::min()) {
      return fmt::format("no TPDO{}", number);
    }
  }
  for (const auto& sensor : force_torque) {
    if (sensor.get() == &node && !sensor->has_sample()) return "no complete sample";
  }
  for (const auto& unit : inertial_units) {
    if (unit.get() == &node && !unit->has_sample()) return "no complete sample";
  }
  for (const auto* drives : {&joint_drives, &hand_drives}) {
    for (const auto& slot : *drives) {
      const cia402::JointDrive& drive = *slot->drive;
      if (&drive != &node) continue;
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
    if (!bus->reset) continue;
    if (const auto record = watchdog.judge(bus->master, at)) {
      // A recovery waits for a link that is still broken; full queues empty themselves.
      const bool patient = recovering && bus->master.link_lost();
      if (record->detail == FaultDetail::kFrameRefused ||
          (bus->master.link_lost() && (!patient || at - phase_began >= options.boot_timeout))) {
        throw std::runtime_error(describe(*record).text);
      }
    }
  }
  if (at - phase_began < options.boot_timeout) return;
  const auto limit = std::chrono::duration_cast<std::chrono::milliseconds>(options.boot_timeout).count();
  for (const auto& bus : buses) {
    if (!bus->power_up) continue;
    if (bus->reset && !bus->commanded) {
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

void Robot::Impl::finish_boot(Time at) {
  phase = Phase::kRunning;
  recovering = false;
  fault.reset();
  described.reset();
  for (auto& bus : buses) {
    bus->master.forget_overflows();
    if (!bus->power_up) continue;
    for (DriveSlot* slot : bus->drives) slot->set_point.hold(slot->drive->target());
    for (canopen::RemoteNode* node : bus->nodes) node->clear_events();
    bus->reset = bus->power_up = bus->link_was_lost = false;
  }
  take_states(at);
}

bool Robot::Impl::step(Time at) {
  receive(at);
  if (recovering) check_links(at);
  // What the links did before the first cycle of this boot is past.
  if (at != phase_began) check_boot_progress(at);
  if (recovering) check_the_others(at);
  if (phase == Phase::kResetting && command_all(canopen::NmtCommand::kResetCommunication)) {
    phase = Phase::kConfiguring;
  } else if (phase == Phase::kConfiguring && configure_all(at)) {
    phase = Phase::kStarting;
    for (auto& bus : buses) {
      if (bus->reset) bus->commanded = false;
    }
  } else if (phase == Phase::kPoweringUp && power_up_all()) {
    finish_boot(at);
    return true;
  }
  if (phase == Phase::kStarting && command_all(canopen::NmtCommand::kStart)) {
    for (auto& bus : buses) {
      if (!bus->reset) continue;
      for (canopen::RemoteNode* node : bus->nodes) node->start(at);
    }
    begin_power_up();
  }
  send_cycle(at);
  return false;
}

bool Robot::Impl::boot(Time at) {
  now = at;
  if (phase == Phase::kRunning && !fault) return true;
  if (!booting() || recovering) begin_boot(at);
  return step(at);
}

}  // namespace walkman::robot
