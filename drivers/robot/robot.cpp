#include "drivers/robot/robot.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "drivers/robot/robot_impl.h"

namespace walkman::robot {
namespace {

double seconds(Time time) { return std::chrono::duration<double>(time).count(); }

}  // namespace

void Robot::Impl::receive(Time at) noexcept {
  for (auto& bus : buses) {
    bus->master.receive(at);
    for (canopen::RemoteNode* node : bus->nodes) node->poll(at);
  }
}

void Robot::Impl::take_states(Time at) noexcept {
  for (auto* drives : {&joint_drives, &hand_drives}) {
    for (auto& slot : *drives) {
      const cia402::DriveSample& sample = slot->drive->sample();
      JointState& state = *slot->state;
      state.motor_position = sample.motor_position;
      state.motor_velocity = sample.motor_velocity;
      state.torque = sample.torque;
      state.link_position = slot->drive->link_position();
      state.statusword = sample.statusword;
      state.mode = sample.mode;
      state.age = age_of(slot->drive->cyclic_data_at(), at);
    }
  }
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const ft::ForceTorqueSample& sample = force_torque[i]->sample();
    sensors[i].F_So_S = sample.F_So_S;
    sensors[i].sample_counter = sample.counter;
    sensors[i].status = sample.status;
    sensors[i].age = age_of(sample.at, at);
  }
  for (std::size_t i = 0; i < imus.size(); ++i) {
    const imu::InertialSample& sample = inertial_units[i]->sample();
    imus[i].specific_force = sample.specific_force;
    imus[i].angular_velocity = sample.angular_velocity;
    imus[i].R_WS = sample.R_WS;
    imus[i].sample_counter = sample.counter;
    imus[i].status = sample.status;
    imus[i].age = age_of(sample.at, at);
  }
}

void Robot::Impl::latch(const FaultRecord& candidate) noexcept {
  if (fault) return;
  fault = candidate;
  for (auto* drives : {&joint_drives, &hand_drives}) {
    for (auto& slot : *drives) slot->set_point.hold();
  }
}

std::optional<FaultRecord> Robot::Impl::judge(const BusSlot& bus, Time at) const noexcept {
  for (const DriveSlot* slot : bus.drives) {
    if (const auto record = watchdog.judge(*slot->drive, slot->limits, at)) return record;
  }
  for (const ft::ForceTorqueSensor* sensor : bus.sensors) {
    if (const auto record = watchdog.judge(*sensor, at)) return record;
  }
  for (const imu::InertialUnit* unit : bus.imus) {
    if (const auto record = watchdog.judge(*unit, at)) return record;
  }
  return std::nullopt;
}

void Robot::Impl::judge(Time at) noexcept {
  for (auto& bus : buses) bus->link_was_lost = bus->link_was_lost || bus->master.link_lost();
  if (fault) return;
  for (auto& bus : buses) {
    if (const auto record = watchdog.judge(bus->master, at)) return latch(*record);
  }
  for (auto& bus : buses) {
    if (const auto record = judge(*bus, at)) return latch(*record);
  }
}

void Robot::Impl::advance_set_points() noexcept {
  for (auto* drives : {&joint_drives, &hand_drives}) {
    for (auto& slot : *drives) {
      if (!turn_of(*slot->drive)) continue;
      const double period = seconds(options.cycle) * slot->drive->sync_divider();
      slot->set_point.advance(slot->limits.velocity * period, period);
      slot->drive->set_target(slot->set_point.value(), slot->set_point.velocity());
    }
  }
}

bool Robot::Impl::driving(const BusSlot& bus) const noexcept {
  if (phase == Phase::kRunning || phase == Phase::kPoweringUp) return true;
  return recovering && !bus.reset;
}

void Robot::Impl::send_rpdos(BusSlot& bus) noexcept {
  can::Frame frame;
  for (const DriveSlot* slot : bus.drives) {
    const cia402::JointDrive& drive = *slot->drive;
    if (drive.stage() != canopen::RemoteNode::Stage::kStarted || !drive.has_samples() || !turn_of(drive))
      continue;
    for (int number = 1; number <= 4; ++number) {
      if (drive.rpdo(number, frame)) bus.master.send(frame);
    }
  }
}

void Robot::Impl::send_cycle(Time at) noexcept {
  for (auto& bus : buses) bus->master.sync();
  for (auto& bus : buses) {
    if (driving(*bus)) send_rpdos(*bus);
    if (phase == Phase::kStopped && !bus->commanded)
      bus->commanded = bus->master.nmt(canopen::NmtCommand::kStop);
    bus->master.heartbeat(at);
    bus->master.send_requests();
    bus->master.end_cycle();
  }
  ++syncs;
}

Robot::Robot(const RobotModel& model, const DeviceTable& table,
             const std::vector<can::Interface*>& interfaces, const RobotOptions& options)
    : impl_(std::make_unique<Impl>(model, table, interfaces, options)) {}

Robot::~Robot() = default;

bool Robot::boot(Time now) {
  try {
    return impl_->boot(now);
  } catch (const std::runtime_error&) {
    stop();
    impl_->phase = Impl::Phase::kIdle;
    throw;
  }
}

bool Robot::recover(Time now) {
  try {
    return impl_->recover(now);
  } catch (const std::runtime_error&) {
    impl_->recovering = false;
    impl_->phase = Impl::Phase::kRunning;
    throw;
  }
}

void Robot::collect(Time now) noexcept {
  for (auto& bus : impl_->buses) bus->master.receive(now);
}

bool Robot::settled() const noexcept {
  for (const auto& bus : impl_->buses) {
    for (const canopen::RemoteNode* node : bus->nodes) {
      if (!node->settled()) return false;
    }
  }
  return true;
}

bool Robot::read(Time now) noexcept {
  impl_->now = now;
  impl_->receive(now);
  impl_->take_states(now);
  if (impl_->phase == Impl::Phase::kRunning) impl_->judge(now);
  return !impl_->fault;
}

void Robot::write(const std::vector<JointCommand>& commands) noexcept {
  Impl& robot = *impl_;
  if (robot.phase != Impl::Phase::kRunning || robot.fault) return;
  FaultRecord record;
  record.time = robot.now;
  if (commands.size() != robot.joint_drives.size()) {
    record.kind = FaultKind::kLimit;
    record.detail = FaultDetail::kCommandCount;
    record.number = static_cast<std::uint32_t>(commands.size());
    record.a = static_cast<double>(robot.joint_drives.size());
    return robot.latch(record);
  }
  for (std::size_t i = 0; i < commands.size(); ++i) {
    if (std::isfinite(commands[i].link_position) && std::isfinite(commands[i].feedforward_torque)) continue;
    record.kind = FaultKind::kNotFinite;
    record.detail = FaultDetail::kCommandNotFinite;
    record.node = robot.joint_drives[i]->drive.get();
    return robot.latch(record);
  }
  for (std::size_t i = 0; i < commands.size(); ++i) {
    DriveSlot& slot = *robot.joint_drives[i];
    const SetPointLimits& limits = slot.limits;
    const double position = std::clamp(commands[i].link_position, limits.lower, limits.upper);
    const double torque = std::clamp(commands[i].feedforward_torque, -limits.effort, limits.effort);
    slot.set_point.set_goal(slot.drive->motor_position_for(position, torque));
    if (std::abs(commands[i].link_position - position) > robot.options.limit_tolerance &&
        record.node == nullptr) {
      record.kind = FaultKind::kLimit;
      record.detail = FaultDetail::kCommandLimit;
      record.node = slot.drive.get();
      record.a = commands[i].link_position;
      record.b = position;
    }
  }
  if (record.node != nullptr) robot.latch(record);
}

void Robot::write_hand(int hand, double closure, double torque_limit) noexcept {
  Impl& robot = *impl_;
  if (robot.phase != Impl::Phase::kRunning || robot.fault) return;
  FaultRecord record;
  record.time = robot.now;
  if (hand < 0 || static_cast<std::size_t>(hand) >= robot.hand_drives.size()) {
    record.kind = FaultKind::kLimit;
    record.detail = FaultDetail::kNoSuchHand;
    record.number = static_cast<std::uint32_t>(hand);
    record.a = static_cast<double>(robot.hand_drives.size());
    return robot.latch(record);
  }
  DriveSlot& slot = *robot.hand_drives[static_cast<std::size_t>(hand)];
  if (!std::isfinite(closure) || !std::isfinite(torque_limit)) {
    record.kind = FaultKind::kNotFinite;
    record.detail = FaultDetail::kCommandNotFinite;
    record.node = slot.drive.get();
    return robot.latch(record);
  }
  const SetPointLimits& limits = slot.limits;
  slot.set_point.set_goal(limits.lower + std::clamp(closure, 0.0, 1.0) * (limits.upper - limits.lower));
  slot.drive->limit_torque(
      static_cast<std::uint16_t>(std::lround(std::clamp(torque_limit, 0.0, 1.0) * 1000)));
}

void Robot::tare(int sensor) noexcept {
  if (sensor < 0 || static_cast<std::size_t>(sensor) >= impl_->force_torque.size()) return;
  if (impl_->phase == Impl::Phase::kRunning) impl_->force_torque[static_cast<std::size_t>(sensor)]->tare();
}

TareState Robot::tare_state(int sensor) const noexcept {
  if (sensor < 0 || static_cast<std::size_t>(sensor) >= impl_->force_torque.size()) return TareState::kFailed;
  switch (impl_->force_torque[static_cast<std::size_t>(sensor)]->tare_state()) {
    case ft::TareState::kIdle:
      return TareState::kIdle;
    case ft::TareState::kBusy:
      return TareState::kBusy;
    case ft::TareState::kDone:
      return TareState::kDone;
    case ft::TareState::kFailed:
      return TareState::kFailed;
  }
  return TareState::kFailed;
}

void Robot::sync(Time now) noexcept {
  impl_->now = now;
  if (impl_->phase == Impl::Phase::kRunning) impl_->advance_set_points();
  impl_->send_cycle(now);
}

void Robot::stop() noexcept {
  Impl& robot = *impl_;
  robot.phase = Impl::Phase::kStopped;
  robot.recovering = false;
  can::Frame frame;
  for (auto& bus : robot.buses) {
    for (DriveSlot* slot : bus->drives) {
      slot->drive->quick_stop();
      for (int number = 1; number <= 4; ++number) {
        if (slot->drive->carries_controlword(number) && slot->drive->rpdo(number, frame))
          bus->master.send(frame);
      }
    }
    bus->commanded = bus->master.nmt(canopen::NmtCommand::kStop);
    bus->master.interface().flush();
    for (canopen::RemoteNode* node : bus->nodes) node->stop();
  }
}

const std::vector<std::string>& Robot::joint_names() const { return impl_->joint_names; }
const std::vector<JointState>& Robot::joints() const { return impl_->joints; }
const std::vector<std::string>& Robot::hand_names() const { return impl_->hand_names; }
const std::vector<JointState>& Robot::hands() const { return impl_->hands; }
const std::vector<std::string>& Robot::sensor_names() const { return impl_->sensor_names; }
const std::vector<ForceTorqueState>& Robot::sensors() const { return impl_->sensors; }

const std::vector<std::string>& Robot::imu_names() const { return impl_->imu_names; }
const std::vector<InertialState>& Robot::imus() const { return impl_->imus; }

}  // namespace walkman::robot
