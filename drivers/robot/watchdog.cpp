#include "drivers/robot/watchdog.h"

#include <algorithm>

#include "drivers/canopen/master.h"
#include "drivers/cia402/joint_drive.h"
#include "drivers/cia404/force_torque_sensor.h"
#include "drivers/cia404/inertial_unit.h"
#include "drivers/robot/set_point.h"

namespace walkman::robot {
namespace {

// A motor may stand this far outside its joint's limits: deflected spring, soft stop, calibration.
constexpr double kReachMargin = 0.5;  // rad

double seconds(Time time) { return std::chrono::duration<double>(time).count(); }

FaultRecord record_of(const canopen::RemoteNode& node, FaultKind kind, FaultDetail detail, Time now) {
  FaultRecord record;
  record.kind = kind;
  record.detail = detail;
  record.node = &node;
  record.time = now;
  return record;
}

}  // namespace

std::optional<FaultRecord> Watchdog::events(const canopen::RemoteNode& node, Time now) const noexcept {
  if (node.stage() == canopen::RemoteNode::Stage::kLost) {
    return record_of(node, FaultKind::kUnexpectedBootUp, FaultDetail::kBootUp, now);
  }
  if (node.emergency()) {
    FaultRecord record = record_of(node, FaultKind::kEmergency, FaultDetail::kEmergency, now);
    record.number = node.emergency()->code | static_cast<std::uint32_t>(node.emergency()->error_register)
                                                 << 16;
    return record;
  }
  return std::nullopt;
}

bool Watchdog::heartbeat_lost(const canopen::RemoteNode& node, Time now) const noexcept {
  return node.heartbeat_age(now) > options_.heartbeat_timeout;
}

std::optional<FaultRecord> Watchdog::stale(const canopen::RemoteNode& node, Time now) const noexcept {
  for (int number = 1; number <= 4; ++number) {
    const Time limit = options_.cycle * options_.stale_after_cycles * node.sync_divider(number);
    const Time age = age_of(node.tpdo_at(number), now);
    if (limit == Time{0} || age <= limit) continue;
    FaultRecord record = record_of(node, FaultKind::kDataStale, FaultDetail::kNoTpdo, now);
    record.number = static_cast<std::uint32_t>(number);
    record.a = age == Time::max() ? -1.0 : seconds(age);
    record.b = seconds(limit);
    return record;
  }
  return std::nullopt;
}

std::optional<FaultRecord> Watchdog::supervision(const canopen::RemoteNode& node, Time now) const noexcept {
  if (node.nmt_state() != canopen::NmtState::kOperational) {
    FaultRecord record = record_of(node, FaultKind::kNmtState, FaultDetail::kNmtState, now);
    record.number = static_cast<std::uint32_t>(node.nmt_state());
    return record;
  }
  if (heartbeat_lost(node, now)) {
    FaultRecord record = record_of(node, FaultKind::kHeartbeatLost, FaultDetail::kHeartbeat, now);
    record.a = seconds(node.heartbeat_age(now));
    record.b = seconds(options_.heartbeat_timeout);
    return record;
  }
  if (node.request_failed()) {
    FaultRecord record = record_of(node, FaultKind::kRequestFailed, FaultDetail::kRequest, now);
    record.number = static_cast<std::uint32_t>(node.failed_address().index) << 8 | node.failed_address().sub;
    record.code = static_cast<std::uint32_t>(node.failed_code());
    return record;
  }
  return std::nullopt;
}

std::optional<FaultRecord> Watchdog::judge(const cia402::JointDrive& drive, const SetPointLimits& limits,
                                           Time now) const noexcept {
  if (auto record = events(drive, now)) return record;
  const cia402::DriveSample& sample = drive.sample();
  if (drive.has_samples() && drive.state() != cia402::State::kOperationEnabled) {
    FaultRecord record = record_of(drive, FaultKind::kDriveFault, FaultDetail::kDriveState, now);
    record.number = sample.statusword | static_cast<std::uint32_t>(sample.error_code) << 16;
    return record;
  }
  if (auto record = supervision(drive, now)) return record;
  if (auto record = stale(drive, now)) return record;
  if (drive.counter_stuck_for() > options_.heartbeat_timeout) {
    FaultRecord record = record_of(drive, FaultKind::kDataStale, FaultDetail::kCounterStuck, now);
    record.number = drive.cycle_counter();
    record.a = seconds(drive.counter_stuck_for());
    return record;
  }
  if (drive.implausible_step() != 0) {
    FaultRecord record = record_of(drive, FaultKind::kNotFinite, FaultDetail::kPositionStep, now);
    record.a = drive.implausible_step();
    return record;
  }
  const bool below = sample.motor_position < limits.lower - kReachMargin;
  if (below || sample.motor_position > limits.upper + kReachMargin) {
    FaultRecord record = record_of(drive, FaultKind::kNotFinite, FaultDetail::kPositionRange, now);
    record.a = sample.motor_position;
    record.b = below ? limits.lower : limits.upper;
    return record;
  }
  if (sample.torque_out_of_range)
    return record_of(drive, FaultKind::kNotFinite, FaultDetail::kOutOfRange, now);
  return std::nullopt;
}

template <typename Sample>
std::optional<FaultRecord> Watchdog::sample_of(const canopen::RemoteNode& node, const Sample& sample,
                                               Time now) const noexcept {
  if (auto record = events(node, now)) return record;
  if (auto record = supervision(node, now)) return record;
  if (auto record = stale(node, now)) return record;
  int divider = 1;
  for (int number = 1; number <= 4; ++number) divider = std::max(divider, node.sync_divider(number));
  if (age_of(sample.at, now) > options_.cycle * options_.stale_after_cycles * divider) {
    FaultRecord record = record_of(node, FaultKind::kDataStale, FaultDetail::kCounterStuck, now);
    record.number = sample.counter;
    record.a = seconds(age_of(sample.at, now));
    return record;
  }
  if (sample.status != 0) {
    FaultRecord record = record_of(node, FaultKind::kSensorInvalid, FaultDetail::kSensorStatus, now);
    record.number = sample.status;
    return record;
  }
  if (sample.out_of_range) return record_of(node, FaultKind::kNotFinite, FaultDetail::kOutOfRange, now);
  return std::nullopt;
}

std::optional<FaultRecord> Watchdog::judge(const ft::ForceTorqueSensor& sensor, Time now) const noexcept {
  return sample_of(sensor, sensor.sample(), now);
}

std::optional<FaultRecord> Watchdog::judge(const imu::InertialUnit& unit, Time now) const noexcept {
  return sample_of(unit, unit.sample(), now);
}

std::optional<FaultRecord> Watchdog::judge(const canopen::Master& master, Time now) const noexcept {
  FaultRecord record;
  record.kind = FaultKind::kInterfaceDown;
  record.interface = &master.interface();
  record.time = now;
  if (master.link() == can::LinkState::kBusOff) {
    record.kind = FaultKind::kBusOff;
    record.detail = FaultDetail::kBusOff;
    return record;
  }
  if (master.link() == can::LinkState::kDown) {
    record.detail = FaultDetail::kInterfaceDown;
    return record;
  }
  if (master.frame_refused()) {
    record.detail = FaultDetail::kFrameRefused;
    return record;
  }
  if (master.full_cycles() >= options_.stale_after_cycles) {
    record.detail = FaultDetail::kQueueFull;
    record.number = static_cast<std::uint32_t>(master.full_cycles());
    return record;
  }
  if (master.new_overflows() > 0) {
    record.kind = FaultKind::kReceiveOverflow;
    record.detail = FaultDetail::kReceiveOverflow;
    record.number = static_cast<std::uint32_t>(std::min<std::uint64_t>(master.new_overflows(), UINT32_MAX));
    return record;
  }
  return std::nullopt;
}

}  // namespace walkman::robot
