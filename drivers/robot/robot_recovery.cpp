#include <stdexcept>

#include "drivers/robot/robot_impl.h"

namespace walkman::robot {

bool Robot::Impl::needs_reset(const BusSlot& bus, Time at) const noexcept {
  if (bus.link_was_lost || bus.master.link_lost()) return true;
  for (const canopen::RemoteNode* node : bus.nodes) {
    if (node->stage() != canopen::RemoteNode::Stage::kStarted ||
        node->nmt_state() != canopen::NmtState::kOperational || watchdog.heartbeat_lost(*node, at) ||
        watchdog.stale(*node, at)) {
      return true;
    }
  }
  return false;
}

void Robot::Impl::begin_recovery(Time at) {
  recovering = true;
  phase_began = at;
  phase = Phase::kPoweringUp;
  receive(at);
  for (auto& bus : buses) {
    bus->reset = bus->power_up = false;
    if (needs_reset(*bus, at)) {
      begin_reset(*bus, at);
      phase = Phase::kResetting;
      continue;
    }
    // What was latched is known by now; what goes on is found again.
    for (canopen::RemoteNode* node : bus->nodes) node->clear_events();
    bus->master.forget_overflows();
    for (DriveSlot* slot : bus->drives) {
      slot->drive->set_target(slot->set_point.value(), 0);
      bus->power_up = bus->power_up || !slot->drive->powered_up();
    }
  }
  if (phase == Phase::kPoweringUp) begin_power_up();
}

/// A link that breaks (again) takes the boot of its bus back to the beginning.
void Robot::Impl::check_links(Time at) {
  for (auto& bus : buses) {
    if (!bus->reset || !bus->master.link_lost()) continue;
    const bool begun = bus->commanded || phase != Phase::kResetting;
    if (!begun) continue;
    begin_reset(*bus, at);
    if (phase == Phase::kStarting || phase == Phase::kPoweringUp) {
      throw std::runtime_error(std::string(bus->master.interface().name()) +
                               ": the link broke again while its nodes were started");
    }
    phase = Phase::kResetting;
  }
}

void Robot::Impl::check_the_others(Time at) const {
  for (const auto& bus : buses) {
    if (bus->power_up) continue;
    auto record = watchdog.judge(bus->master, at);
    if (!record) record = judge(*bus, at);
    if (record) throw std::runtime_error(describe(*record).text);
  }
}

bool Robot::Impl::recover(Time at) {
  if (!recovering && phase != Phase::kRunning) return boot(at);
  now = at;
  if (!recovering) {
    if (!fault) return true;
    begin_recovery(at);
  }
  return step(at);
}

}  // namespace walkman::robot
