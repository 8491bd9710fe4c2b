#include "drivers/robot/boot.h"

#include <stdexcept>

#include <fmt/format.h>

namespace walkman::robot {
namespace {

using Stage = canopen::RemoteNode::Stage;

long long milliseconds(Time time) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(time).count();
}

/// Number of devices of a bus that have not been heard since NMT reset.
std::size_t awaited(const RobotBus& bus) {
  std::size_t count = 0;
  for (const auto& device : bus.devices()) count += device->stage() == Stage::kAwaitingBootUp ? 1 : 0;
  return count;
}

}  // namespace

void Boot::begin_reset(RobotBus& bus, Time now) {
  bus.commanded = false;
  bus.reset = bus.power_up = true;
  bus.master().discard();
  bus.master().restart_sync_counter();
  for (const auto& device : bus.devices()) device->begin_boot(now);
}

void Boot::begin(Time now) {
  phase_ = Phase::kResetting;
  began_ = now;
  recovering_ = false;
  for (auto& bus : buses_) begin_reset(*bus, now);
}

bool Boot::needs_reset(const RobotBus& bus, Time now, bool own_delay) noexcept {
  if (bus.link_was_lost || bus.master().link_lost()) return true;
  for (const auto& device : bus.devices()) {
    if (device->stage() != Stage::kStarted || device->nmt_state() != canopen::NmtState::kOperational ||
        device->heartbeat_lost(now) || (!own_delay && device->stale(now))) {
      return true;
    }
  }
  return false;
}

void Boot::begin_recovery(Time now, bool own_delay) {
  recovering_ = true;
  began_ = now;
  phase_ = Phase::kPoweringUp;
  for (auto& bus : buses_) {
    bus->reset = false;
    bus->power_up = own_delay;
    if (needs_reset(*bus, now, own_delay)) {
      begin_reset(*bus, now);
      phase_ = Phase::kResetting;
      continue;
    }
    // Latched events are already known; those that persist are found again.
    bus->master().forget_overflows();
    for (const auto& device : bus->devices()) {
      device->clear_events();
      device->hold();
      bus->power_up = bus->power_up || !device->in_operation();
    }
  }
  if (phase_ == Phase::kPoweringUp) begin_power_up();
}

bool Boot::command_all(canopen::NmtCommand command) noexcept {
  bool all = true;
  for (auto& bus : buses_) {
    if (!bus->reset) continue;
    if (!bus->commanded) {
      bus->commanded = bus->master().nmt(command);
      if (bus->commanded && command == canopen::NmtCommand::kResetCommunication) {
        for (const auto& device : bus->devices()) device->reset_sent();
      }
    }
    all = all && bus->commanded;
  }
  return all;
}

bool Boot::configure_all(Time now) {
  bool all = true;
  for (auto& bus : buses_) {
    if (!bus->reset) continue;
    try {
      for (const auto& device : bus->devices()) all = device->configure(now) && all;
    } catch (const std::runtime_error& error) {
      const auto flooded = bus->flood();
      if (!flooded) throw;
      throw std::runtime_error(
          fmt::format("{}: {}; {}", bus->name(), canopen::sentence(*flooded), error.what()));
    }
  }
  return all;
}

void Boot::begin_power_up() noexcept {
  phase_ = Phase::kPoweringUp;
  for (auto& bus : buses_) {
    if (!bus->power_up) continue;
    for (const auto& device : bus->devices()) device->begin_power_up();
  }
}

bool Boot::power_up_all(Time now, std::uint64_t syncs) {
  bool all = true;
  for (auto& bus : buses_) {
    if (!bus->power_up) continue;
    for (const auto& device : bus->devices()) {
      if (device->stage() == Stage::kLost) {
        throw std::runtime_error(device->label() + ": booted up again after NMT start");
      }
      // Each evaluation of the statusword selects a controlword, so only when the next is about to be sent.
      if (RobotBus::has_turn(*device, syncs)) device->power_up();
      all = all && device->nmt_state() == canopen::NmtState::kOperational && device->in_operation() &&
            !device->stale(now);
    }
  }
  return all;
}

/// A link that fails (again) takes the boot of its bus back to the beginning.
void Boot::check_links(Time now) {
  for (auto& bus : buses_) {
    if (!bus->reset || !bus->master().link_lost()) continue;
    const bool begun = bus->commanded || phase_ != Phase::kResetting;
    if (!begun) continue;
    begin_reset(*bus, now);
    if (phase_ == Phase::kStarting || phase_ == Phase::kPoweringUp) {
      throw std::runtime_error(bus->name() + ": the link broke again while its nodes were started");
    }
    phase_ = Phase::kResetting;
  }
}

void Boot::check_the_others(Time now) const {
  for (const auto& bus : buses_) {
    if (bus->power_up) continue;
    if (const auto record = bus->judge(now)) throw std::runtime_error(describe(*record).text);
  }
}

void Boot::fail(Time now) const {
  std::size_t devices = 0;
  std::size_t silent = 0;
  std::size_t buses = 0;
  const RobotBus* first = nullptr;
  for (const auto& bus : buses_) {
    if (!bus->power_up) continue;
    ++buses;
    devices += bus->devices().size();
    if (bus->devices().size() < 2 || awaited(*bus) < bus->devices().size()) continue;
    silent += bus->devices().size();
    if (first == nullptr) first = bus.get();
  }
  const auto limit = milliseconds(options_.boot_timeout);
  if (first != nullptr && silent == devices && buses > 1) {
    throw std::runtime_error(
        fmt::format("robot: no boot-up message of any of the {} devices on {} buses within {} ms: the robot "
                    "(or its emulator) is off or stalled",
                    devices, buses, limit));
  }
  if (first != nullptr) {
    throw std::runtime_error(
        fmt::format("{}: no boot-up message of any of its {} devices within {} ms: the bus is cut, or they "
                    "have no power",
                    first->name(), first->devices().size(), limit));
  }
  for (const auto& bus : buses_) {
    if (!bus->power_up) continue;
    if (bus->reset && !bus->commanded) {
      throw std::runtime_error(
          fmt::format("{}: transmit queue did not take an NMT command within {} ms", bus->name(), limit));
    }
    for (const auto& device : bus->devices()) {
      std::string missing = device->what_is_missing();
      // A node that waits for the others to be configured sends none yet.
      if (const auto stale = device->stale(now);
          missing.empty() && stale && device->stage() == Stage::kStarted)
        missing = canopen::sentence(*stale);
      if (missing.empty()) continue;
      throw std::runtime_error(fmt::format("{}: {} within {} ms", device->label(), missing, limit));
    }
  }
  throw std::runtime_error(fmt::format("robot: not booted within {} ms", limit));
}

void Boot::check_progress(Time now) const {
  const bool too_late = now - began_ >= options_.boot_timeout;
  for (const auto& bus : buses_) {
    if (!bus->reset) continue;
    const auto record = bus->judge_link(now);
    if (!record) continue;
    // A recovery waits for a link that is still broken; full queues drain by themselves.
    const bool lost = bus->master().link_lost();
    if (std::holds_alternative<canopen::cause::FrameRefused>(record->cause) ||
        (lost && (!recovering_ || too_late))) {
      throw std::runtime_error(describe(*record).text);
    }
  }
  if (!too_late) return;
  for (const auto& bus : buses_) {
    if (!bus->power_up) continue;
    if (const auto flooded = bus->flood()) {
      throw std::runtime_error(bus->name() + ": " + canopen::sentence(*flooded));
    }
  }
  fail(now);
}

void Boot::finish() noexcept {
  phase_ = Phase::kNone;
  for (auto& bus : buses_) {
    bus->master().forget_overflows();
    if (!bus->power_up) continue;
    for (const auto& device : bus->devices()) {
      device->end_power_up();
      device->clear_events();
    }
    bus->reset = bus->power_up = bus->link_was_lost = false;
  }
}

bool Boot::step(Time now, std::uint64_t syncs) {
  if (recovering_) check_links(now);
  // Link events before the first cycle of this boot do not count.
  if (now != began_) check_progress(now);
  if (recovering_) check_the_others(now);
  if (phase_ == Phase::kResetting && command_all(canopen::NmtCommand::kResetCommunication)) {
    phase_ = Phase::kConfiguring;
  } else if (phase_ == Phase::kConfiguring && configure_all(now)) {
    phase_ = Phase::kStarting;
    for (auto& bus : buses_) {
      if (bus->reset) bus->commanded = false;
    }
  } else if (phase_ == Phase::kPoweringUp && power_up_all(now, syncs)) {
    finish();
    return true;
  }
  if (phase_ == Phase::kStarting && command_all(canopen::NmtCommand::kStart)) {
    for (auto& bus : buses_) {
      if (!bus->reset) continue;
      for (const auto& device : bus->devices()) device->start(now);
    }
    begin_power_up();
  }
  return false;
}

}  // namespace walkman::robot
