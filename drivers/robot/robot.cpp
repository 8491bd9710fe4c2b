#include "drivers/robot/robot.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "drivers/robot/bus_load.h"
#include "drivers/robot/device_kinds.h"

namespace walkman::robot {
namespace {

namespace cause = canopen::cause;

}  // namespace

Robot::Robot(const RobotModel& model, const DeviceTable& table,
             const std::vector<can::Interface*>& interfaces, const RobotOptions& options)
    : options_(options) {
  if (interfaces.size() != table.buses.size()) {
    throw std::runtime_error(fmt::format("device table has {} buses, {} CAN interfaces given",
                                         table.buses.size(), interfaces.size()));
  }
  if (!options_.allow_overload) require_capacity(table, options_.layout, options_.cycle);
  const int overflow = options_.sync_counter_overflow;
  if (overflow != 0 && (overflow < 2 || overflow > 240)) {
    throw std::runtime_error(fmt::format("SYNC counter overflow is {}, expected 0 or 2 to 240", overflow));
  }
  const std::vector<BusLoad> loads =
      bus_loads(table, options_.layout, options_.cycle, options_.heartbeat_producer);
  for (std::size_t i = 0; i < table.buses.size(); ++i) {
    const Bus& bus = table.buses[i];
    buses_.push_back(std::make_unique<RobotBus>(
        *interfaces[i], can::BitRates{bus.bit_rate, bus.data_bit_rate}, loads[i].with_events, options_));
    for (const Device& device : bus.devices) add(model, device, bus, *buses_.back());
  }
}

canopen::NodeSettings Robot::node_settings(const Device& device, const RobotBus& bus) const {
  canopen::NodeSettings settings;
  settings.node_id = device.node_id;
  settings.name = device.name;
  settings.interface = bus.name();
  settings.noun = driver_of(device.kind).noun;
  settings.cycle = options_.cycle;
  settings.heartbeat_producer = options_.heartbeat_producer;
  settings.heartbeat_timeout = options_.heartbeat_timeout;
  settings.stale_after_cycles = options_.stale_after_cycles;
  settings.identity = options_.identities.of(device.kind, device.node_id);
  settings.pdos = options_.layout.of(device.kind);
  settings.fd = options_.layout.fd;
  settings.sync_overflow = static_cast<std::uint8_t>(options_.sync_counter_overflow);
  return settings;
}

void Robot::add(const RobotModel& model, const Device& device, const Bus& bus, RobotBus& robot_bus) {
  if (device.node_id < 1 || device.node_id >= canopen::kMasterNodeId) {
    throw std::runtime_error(
        fmt::format("bus {}: {} has node-ID {}, expected 1..126", bus.name, device.name, device.node_id));
  }
  for (const auto& other : robot_bus.devices()) {
    if (other->node_id() != device.node_id) continue;
    throw std::runtime_error(fmt::format("bus {}: node-ID {} is used by {} and {}", bus.name, device.node_id,
                                         other->settings().name, device.name));
  }
  auto made = driver_of(device.kind)
                  .make({device, model, options_.max_joint_velocity, node_settings(device, robot_bus)});
  if (auto* drive = dynamic_cast<cia402::JointDrive*>(made.get())) {
    const bool hand = device.kind == DeviceKind::kHandDrive;
    (hand ? hands_ : joints_).push_back(drive);
    (hand ? hand_names_ : joint_names_).push_back(device.name);
  } else if (auto* sensor = dynamic_cast<cia404::ForceTorqueSensor*>(made.get())) {
    sensors_.push_back(sensor);
    sensor_names_.push_back(device.name);
  }
  robot_bus.add(std::move(made));
}

const canopen::RemoteNode* Robot::find_device(const std::string& name) const noexcept {
  for (const auto& bus : buses_) {
    for (const auto& device : bus->devices()) {
      if (device->settings().name == name) return device.get();
    }
  }
  return nullptr;
}

bool Robot::boot(Time now) {
  if (state_ == State::kRunning && !fault_) {
    now_ = now;
    return true;
  }
  if (state_ != State::kBooting || boot_.recovering()) {
    state_ = State::kBooting;
    fault_.reset();
    described_.reset();
    boot_.begin(now);
  }
  try {
    return step(now);
  } catch (const std::runtime_error&) {
    stop();
    state_ = State::kIdle;
    throw;
  }
}

bool Robot::recover(Time now) {
  const bool recovering = state_ == State::kBooting && boot_.recovering();
  if (!recovering && state_ != State::kRunning) return boot(now);
  if (!recovering) {
    if (!fault_) {
      now_ = now;
      return true;
    }
    state_ = State::kBooting;
    receive(now);
    boot_.begin_recovery(now, std::holds_alternative<cause::CycleLate>(fault_->cause));
  }
  try {
    return step(now);
  } catch (const std::runtime_error&) {
    boot_.abandon();
    state_ = State::kRunning;
    read_at_ = Time::min();
    throw;
  }
}

bool Robot::step(Time now) {
  now_ = now;
  receive(now);
  if (boot_.step(now, syncs_)) {
    state_ = State::kRunning;
    read_at_ = Time::min();
    fault_.reset();
    described_.reset();
    return true;
  }
  send_cycle(now);
  return false;
}

void Robot::receive(Time now) noexcept {
  for (auto& bus : buses_) bus->receive(now);
}

void Robot::collect(Time now) noexcept {
  for (auto& bus : buses_) bus->master().receive(now);
}

bool Robot::cycle_complete() const noexcept {
  for (const auto& bus : buses_) {
    for (const auto& device : bus->devices()) {
      if (!device->cycle_complete()) return false;
    }
  }
  return true;
}

bool Robot::read(Time now) noexcept {
  now_ = now;
  receive(now);
  if (state_ == State::kRunning) {
    judge(now);
    read_at_ = now;
  }
  return !fault_;
}

void Robot::judge(Time now) noexcept {
  for (auto& bus : buses_) bus->link_was_lost = bus->link_was_lost || bus->master().link_lost();
  if (fault_) return;
  for (auto& bus : buses_) {
    if (const auto found = bus->judge_link(now)) return latch(of_all_buses(*found, now));
  }
  // Data cannot be newer than the last SYNC, and drives that miss the master stop: not the devices' fault.
  const Time gap = read_at_ == Time::min() ? Time{0} : now - read_at_;
  if (gap > options_.cycle * options_.stale_after_cycles) {
    return latch({cause::CycleLate{gap, options_.cycle}, nullptr, nullptr, now});
  }
  for (auto& bus : buses_) {
    if (const auto found = bus->judge_devices(now)) return latch(of_all_buses(*found, now));
  }
}

FaultRecord Robot::of_all_buses(const FaultRecord& record, Time now) const noexcept {
  const auto* silent = std::get_if<cause::BusSilent>(&record.cause);
  if (silent == nullptr || silent->heard || buses_.size() < 2) return record;
  cause::BusSilent all{0, static_cast<int>(buses_.size()), Time::max(), false};
  for (const auto& bus : buses_) {
    const Time quiet = bus->quiet_for(now);
    if (quiet < bus->quiet_limit()) return record;
    all.devices += static_cast<int>(bus->devices().size());
    all.age = std::min(all.age, quiet);
  }
  return {all, nullptr, nullptr, now};
}

void Robot::latch(const FaultRecord& candidate) noexcept {
  if (fault_) return;
  fault_ = candidate;
  for (auto& bus : buses_) {
    for (const auto& device : bus->devices()) device->hold();
  }
}

void Robot::latch_command(const canopen::FaultCause& what, const canopen::RemoteNode* device) noexcept {
  latch({what, device, nullptr, now_});
}

void Robot::write(const std::vector<JointCommand>& commands) noexcept {
  if (state_ != State::kRunning || fault_) return;
  if (commands.size() != joints_.size()) {
    return latch_command(cause::CommandCount{commands.size(), joints_.size()}, nullptr);
  }
  for (std::size_t i = 0; i < commands.size(); ++i) {
    if (std::isfinite(commands[i].link_position) && std::isfinite(commands[i].feedforward_torque)) continue;
    return latch_command(cause::CommandNotFinite{}, joints_[i]);
  }
  std::optional<cause::CommandBeyondLimit> beyond;
  const cia402::JointDrive* who = nullptr;
  for (std::size_t i = 0; i < commands.size(); ++i) {
    const double wanted = commands[i].link_position;
    const double taken = joints_[i]->command(wanted, commands[i].feedforward_torque);
    if (std::abs(wanted - taken) <= options_.limit_tolerance || beyond) continue;
    beyond = cause::CommandBeyondLimit{wanted, taken};
    who = joints_[i];
  }
  if (beyond) latch_command(*beyond, who);
}

void Robot::write_hand(int hand, double closure, double torque_limit) noexcept {
  if (state_ != State::kRunning || fault_) return;
  if (hand < 0 || static_cast<std::size_t>(hand) >= hands_.size()) {
    return latch_command(cause::NoSuchHand{hand, hands_.size()}, nullptr);
  }
  cia402::JointDrive& drive = *hands_[static_cast<std::size_t>(hand)];
  if (!std::isfinite(closure) || !std::isfinite(torque_limit)) {
    return latch_command(cause::CommandNotFinite{}, &drive);
  }
  drive.command_travel(closure);
  drive.limit_torque(static_cast<std::uint16_t>(std::lround(std::clamp(torque_limit, 0.0, 1.0) * 1000)));
}

void Robot::sync(Time now) noexcept {
  now_ = now;
  if (state_ == State::kRunning) {
    for (auto& bus : buses_) {
      for (const auto& device : bus->devices()) {
        if (RobotBus::has_turn(*device, syncs_)) device->advance();
      }
    }
  }
  send_cycle(now);
}

void Robot::send_cycle(Time now) noexcept {
  for (auto& bus : buses_) bus->master().sync();
  for (auto& bus : buses_) {
    canopen::Master& master = bus->master();
    if (state_ == State::kRunning || (state_ == State::kBooting && boot_.drives(*bus)))
      bus->send_rpdos(syncs_);
    if (state_ == State::kStopped && !bus->commanded) bus->commanded = master.nmt(canopen::NmtCommand::kStop);
    master.heartbeat(now);
    master.send_requests();
    master.end_cycle(now);
  }
  ++syncs_;
}

void Robot::stop() noexcept {
  state_ = State::kStopped;
  boot_.abandon();
  can::Frame frame;
  for (auto& bus : buses_) {
    for (const auto& device : bus->devices()) {
      device->quick_stop();
      for (int number = 1; number <= 4; ++number) {
        if (device->carries_stop(number) && device->next_rpdo(number, frame)) bus->master().send(frame);
      }
    }
    bus->commanded = bus->master().nmt(canopen::NmtCommand::kStop);
    bus->master().interface().flush();
    for (const auto& device : bus->devices()) device->stop();
  }
}

const std::optional<Fault>& Robot::fault() const {
  if (fault_ && !described_) described_ = describe(*fault_);
  return described_;
}

Counters Robot::counters() const noexcept {
  Counters sum;
  sum.syncs = syncs_;
  for (const auto& bus : buses_) {
    const canopen::Master::Counters& counters = bus->master().counters();
    sum.frames_received += counters.received;
    sum.frames_ignored += counters.ignored;
    sum.foreign_frames += counters.foreign;
    sum.frames_not_sent += counters.not_sent;
    sum.controller_reports += counters.reports;
    sum.receive_overflows += bus->master().interface().receive_overflows();
    for (const auto& device : bus->devices()) sum.emergencies += device->emergencies();
  }
  return sum;
}

std::vector<std::string> Robot::new_warnings() {
  std::vector<std::string> list;
  for (auto& bus : buses_) bus->tell_new_warnings(list);
  return list;
}

}  // namespace walkman::robot
