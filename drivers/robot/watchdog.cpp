#include "drivers/robot/watchdog.h"

#include "drivers/canopen/master.h"
#include "drivers/cia402/joint_drive.h"
#include "drivers/ft/force_torque_sensor.h"
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

std::optional<FaultRecord> stale_tpdo(const canopen::RemoteNode& node, std::uint32_t number, Time at,
                                      Time limit, Time now) {
  const Time age = age_of(at, now);
  if (age <= limit) return std::nullopt;
  FaultRecord record = record_of(node, FaultKind::kDataStale, FaultDetail::kNoTpdo, now);
  record.number = number;
  record.a = age == Time::max() ? -1.0 : seconds(age);
  record.b = seconds(limit);
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

std::optional<FaultRecord> Watchdog::supervision(const canopen::RemoteNode& node, Time now) const noexcept {
  if (node.nmt_state() != canopen::NmtState::kOperational) {
    FaultRecord record = record_of(node, FaultKind::kNmtState, FaultDetail::kNmtState, now);
    record.number = static_cast<std::uint32_t>(node.nmt_state());
    return record;
  }
  if (node.heartbeat_age(now) > options_.heartbeat_timeout) {
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
  const Time limit = options_.cycle * options_.stale_after_cycles * drive.sync_divider();
  if (auto record = stale_tpdo(drive, 1, sample.tpdo1_at, limit, now)) return record;
  if (auto record = stale_tpdo(drive, 2, sample.tpdo2_at, limit, now)) return record;
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

std::optional<FaultRecord> Watchdog::judge(const ft::ForceTorqueSensor& sensor, Time now) const noexcept {
  if (auto record = events(sensor, now)) return record;
  if (auto record = supervision(sensor, now)) return record;
  const Time limit = options_.cycle * options_.stale_after_cycles;
  if (auto record = stale_tpdo(sensor, 1, sensor.tpdo1_at(), limit, now)) return record;
  if (auto record = stale_tpdo(sensor, 2, sensor.tpdo2_at(), limit, now)) return record;
  const ft::ForceTorqueSample& sample = sensor.sample();
  if (age_of(sample.at, now) > limit) {
    FaultRecord record = record_of(sensor, FaultKind::kDataStale, FaultDetail::kCounterStuck, now);
    record.number = sample.counter;
    record.a = seconds(age_of(sample.at, now));
    return record;
  }
  if (sample.status != 0) {
    FaultRecord record = record_of(sensor, FaultKind::kSensorInvalid, FaultDetail::kSensorStatus, now);
    record.number = sample.status;
    return record;
  }
  if (sample.out_of_range) return record_of(sensor, FaultKind::kNotFinite, FaultDetail::kOutOfRange, now);
  return std::nullopt;
}

std::optional<FaultRecord> Watchdog::judge(const canopen::Master& master, Time now) const noexcept {
  FaultRecord record;
  record.kind = FaultKind::kInterfaceDown;
  record.interface = &master.interface();
  record.time = now;
  if (master.interface_down()) {
    record.detail = FaultDetail::kInterfaceDown;
    return record;
  }
  if (master.full_cycles() >= options_.stale_after_cycles) {
    record.detail = FaultDetail::kQueueFull;
    record.number = static_cast<std::uint32_t>(master.full_cycles());
    return record;
  }
  return std::nullopt;
}

}  // namespace walkman::robot
