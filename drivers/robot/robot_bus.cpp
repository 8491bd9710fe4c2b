#include "drivers/robot/robot_bus.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "drivers/canopen/cob_id.h"

namespace walkman::robot {
namespace {

namespace cause = canopen::cause;

// A smaller share of foreign traffic never counts as a flood, however full the bus is by itself.
constexpr double kLeastFlood = 0.1;

}  // namespace

RobotBus::RobotBus(can::Interface& interface, const can::BitRates& rates, double own_load,
                   const RobotOptions& options)
    : master_(interface, rates, options.heartbeat_producer,
              static_cast<std::uint8_t>(options.sync_counter_overflow)),
      own_load_(own_load),
      cycle_(options.cycle),
      stale_after_cycles_(options.stale_after_cycles) {}

void RobotBus::add(std::unique_ptr<canopen::RemoteNode> device) {
  master_.add(*device);
  devices_.push_back(std::move(device));
  told_devices_.push_back(false);
}

void RobotBus::receive(Time now) noexcept {
  master_.receive(now);
  for (const auto& device : devices_) device->poll(now);
}

void RobotBus::send_rpdos(std::uint64_t syncs) noexcept {
  can::Frame frame;
  for (const auto& device : devices_) {
    if (device->stage() != canopen::RemoteNode::Stage::kStarted || !device->has_cyclic_data() ||
        !has_turn(*device, syncs)) {
      continue;
    }
    for (int number = 1; number <= 4; ++number) {
      if (device->next_rpdo(number, frame)) master_.send(frame);
    }
  }
}

FaultRecord RobotBus::record(const canopen::FaultCause& cause, Time now) const noexcept {
  return {cause, nullptr, &master_.interface(), now};
}

std::optional<FaultRecord> RobotBus::judge_link(Time now) const noexcept {
  if (master_.link() == can::LinkState::kBusOff) return record(cause::BusOff{}, now);
  if (master_.link() == can::LinkState::kDown) return record(cause::InterfaceDown{}, now);
  if (master_.frame_refused()) return record(cause::FrameRefused{}, now);
  if (master_.full_cycles() >= stale_after_cycles_) {
    return explained(record(cause::QueueFull{master_.full_cycles()}, now), now);
  }
  if (master_.new_overflows() > 0) {
    return explained(record(cause::ReceiveOverflow{master_.new_overflows()}, now), now);
  }
  return std::nullopt;
}

std::optional<FaultRecord> RobotBus::judge_devices(Time now) const noexcept {
  for (const auto& device : devices_) {
    const auto found = device->judge(now);
    if (!found) continue;
    if (const auto* emergency = std::get_if<cause::Emcy>(&*found))
      if (const auto shared = of_supply(*emergency, now)) return record(*shared, now);
    return explained({*found, device.get(), nullptr, now}, now);
  }
  return std::nullopt;
}

std::optional<cause::SupplyAtFault> RobotBus::of_supply(const cause::Emcy& emergency,
                                                        Time now) const noexcept {
  constexpr int kMains = 0x31, kDcLink = 0x32;  // CiA 402, error codes of voltages outside the device
  const int group = emergency.message.code >> 8;
  if (group != kMains && group != kDcLink) return std::nullopt;
  const auto devices = std::count_if(devices_.begin(), devices_.end(), [&](const auto& device) {
    const auto found = device->judge(now);
    const auto* other = found ? std::get_if<cause::Emcy>(&*found) : nullptr;
    return other != nullptr && other->message.code == emergency.message.code;
  });
  if (devices < 2) return std::nullopt;
  return cause::SupplyAtFault{emergency.message, emergency.meaning, static_cast<int>(devices)};
}

std::optional<FaultRecord> RobotBus::judge(Time now) const noexcept {
  if (const auto found = judge_link(now)) return found;
  return judge_devices(now);
}

Time RobotBus::quiet_for(Time now) const noexcept {
  Time newest = Time::min();
  for (const auto& device : devices_) newest = std::max(newest, device->heard_at());
  return canopen::age_of(newest, now);
}

bool RobotBus::several_overdue(Time now) const noexcept {
  int overdue = 0;
  for (const auto& device : devices_) {
    if (canopen::age_of(device->cyclic_data_at(), now) >= quiet_limit() * device->sync_divider()) ++overdue;
  }
  return overdue > 1;
}

FaultRecord RobotBus::explained(const FaultRecord& symptom, Time now) const noexcept {
  if (!canopen::may_follow_from_the_bus(symptom.cause)) return symptom;
  if (const auto flooded = flood()) return record(*flooded, now);
  if (!several_overdue(now)) return symptom;
  const int devices = static_cast<int>(devices_.size());
  if (quiet_for(now) >= quiet_limit())
    return record(cause::BusSilent{devices, 1, quiet_for(now), false}, now);
  Time newest = Time::min();
  for (const auto& device : devices_) newest = std::max(newest, device->newest_cyclic_at());
  const Time age = canopen::age_of(newest, now);
  if (age < quiet_limit()) return symptom;
  const auto* none = std::get_if<cause::NoTpdo>(&symptom.cause);
  if (none != nullptr && none->refused > 0) return symptom;  // they arrive, but not as they were sent
  // The devices are heard, but this computer's own frames are not getting out.
  if (master_.full_cycles() > 0) return record(cause::QueueFull{master_.full_cycles()}, now);
  return record(cause::BusSilent{devices, 1, age, true}, now);
}

std::optional<cause::BusFlooded> RobotBus::flood() const noexcept {
  const canopen::BusTraffic::Foreign foreign = master_.traffic().foreign();
  if (foreign.load < kLeastFlood || foreign.load + own_load_ < 1) return std::nullopt;
  return cause::BusFlooded{foreign.load, own_load_, foreign.id, foreign.extended, foreign.rate_hz};
}

std::string RobotBus::meaning_of(std::uint32_t cob_id) const {
  if (cob_id == canopen::cob_id::kNmt) return "NMT command";
  if (cob_id == canopen::cob_id::kSync) return "SYNC";
  if (cob_id == canopen::cob_id::error_control(canopen::kMasterNodeId)) return "a master's heartbeat";
  const auto node_id = static_cast<std::uint8_t>(cob_id & 0x7FU);
  std::string whom = fmt::format("node {}", node_id);
  for (const auto& device : devices_) {
    if (device->node_id() == node_id)
      whom = fmt::format("{} {}", device->settings().noun, device->settings().name);
  }
  if ((cob_id & 0x780U) == 0x600) return "SDO request to " + whom;
  return "set-points (RPDO) for " + whom;
}

void RobotBus::tell_new_warnings(std::vector<std::string>& list) {
  const can::LinkState link = master_.interface().link();
  const auto is_new = [](bool now, bool& told) {
    const bool tell = now && !told;
    told = told || now;
    return tell;
  };
  if (is_new(link == can::LinkState::kWarning, told_warning_) ||
      is_new(link == can::LinkState::kPassive, told_passive_)) {
    list.push_back(fmt::format("{}: controller is {}, frames are being lost to errors on the bus", name(),
                               can::name_of(link)));
  }
  const auto flooded = flood();
  if (is_new(flooded.has_value(), told_flood_)) list.push_back(name() + ": " + canopen::sentence(*flooded));
  const auto foreign = master_.foreign_ids();
  if (told_foreign_ < foreign.size()) {
    std::vector<std::string> commands;
    for (; told_foreign_ < foreign.size(); ++told_foreign_) {
      const std::uint32_t id = foreign[told_foreign_];
      commands.push_back(fmt::format("{:03X}h ({})", id, meaning_of(id)));
    }
    list.push_back(
        fmt::format("{}: another master is on the bus and sent {}", name(), fmt::join(commands, ", ")));
  }
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    if (told_devices_[i]) continue;
    const std::string warning = devices_[i]->warning();
    if (warning.empty()) continue;
    told_devices_[i] = true;
    list.push_back(devices_[i]->label() + ": " + warning);
  }
}

}  // namespace walkman::robot
