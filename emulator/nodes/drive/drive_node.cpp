#include "emulator/nodes/drive/drive_node.h"

#include <cmath>
#include <stdexcept>

#include "emulator/nodes/drive/drive_faults.h"
#include "emulator/nodes/drive/drive_table.h"

namespace walkman::nodes {

using cia402::Mode;
using cia402::State;

namespace {

// A motor slower than this is taken to stand still when its motion is handed over, rad/s.
constexpr double kStandstill = 0.02;

const DriveParameters& checked(const DriveParameters& p) {
  const bool positive = p.rated_torque > 0 && p.peak_torque > 0 && p.spring_constant > 0 &&
                        p.motor_inertia > 0 && p.position_bandwidth_hz > 0 && p.max_velocity > 0 &&
                        p.interpolation_ms > 0 && p.motor_encoder_step > 0 && p.rated_current > 0;
  if (!positive || p.sync_divider < 1 || p.sync_divider > 240 || !(p.lower <= p.upper) ||
      !(p.lowest_supply <= p.highest_supply)) {
    throw std::runtime_error(
        "drive " + p.name +
        ": rating, limit or divider out of range, expected positive ratings, lower <= upper, "
        "divider 1 to 240");
  }
  return p;
}

}  // namespace

DriveNode::DriveNode(const DriveParameters& parameters)
    : CanopenSlave(
          {parameters.node_id, kServoDriveType, parameters.name, parameters.product_code, parameters.serial}),
      parameters_(checked(parameters)),
      factory_gains_(ServoGains::factory(parameters_.motor_inertia, parameters_.spring_constant,
                                         parameters_.position_bandwidth_hz)),
      objects_(objects(), parameters_, factory_gains_),
      mode_(&modes_.cyclic_position),
      supervision_(parameters_) {
  connect_hooks();
  forward_targets();
  configure_pdos(drive_rpdos(parameters_), drive_tpdos(parameters_));
  refresh_settings();
}

void DriveNode::connect_hooks() {
  objects_.on_setting([this] { settings_stale_ = true; });
  objects_.on_measurement_read([this] { publish(); });
  objects_.controlword.on_write([this](std::uint16_t word) -> Verdict {
    take_controlword(word);
    return std::nullopt;
  });
  objects_.mode.on_write([this](std::int8_t value) { return take_mode(value); });
}

void DriveNode::forward_targets() {
  const auto forward = [this](Object<std::int32_t>& object, TargetObject target) {
    object.on_write([this, target](std::int32_t value) -> Verdict {
      take_target(target, value);
      return std::nullopt;
    });
  };
  forward(objects_.target_position, TargetObject::kPosition);
  forward(objects_.position_offset, TargetObject::kPositionOffset);
  forward(objects_.target_velocity, TargetObject::kVelocity);
  forward(objects_.interpolation_target, TargetObject::kInterpolation);
}

void DriveNode::refresh_settings() noexcept {
  if (!settings_stale_) return;
  settings_stale_ = false;
  settings_ = ServoSettings::from(objects_, parameters_, factory_gains_);
  law_.set_gains(settings_.gains);
  supervision_.settings_changed();
}

Verdict DriveNode::take_mode(std::int8_t value) noexcept {
  const auto wanted = static_cast<Mode>(value);
  if (wanted == Mode::kNone) return std::nullopt;  // no change
  if (modes_.find(wanted) == nullptr) return SdoAbort::kValue;
  requested_mode_ = wanted;
  // A stop is not disturbed; the mode then becomes active when it has ended.
  if (power_.stopping() || !settle_mode()) return std::nullopt;
  if (power_.state() == State::kOperationEnabled) {
    refresh_settings();
    law_.restart();
    mode_->enter(present_motion());
    mode_->controlword(0, objects_.controlword.get());
  }
  update_statusword();
  announce(objects_.mode_display.entry());
  return std::nullopt;
}

bool DriveNode::settle_mode() noexcept {
  if (requested_mode_ == mode()) return false;
  mode_ = modes_.find(requested_mode_);
  objects_.mode_display.set(static_cast<std::int8_t>(requested_mode_));
  return true;
}

void DriveNode::take_target(TargetObject object, std::int32_t value) noexcept {
  if (!mode_drives()) return;
  refresh_settings();
  mode_->target(object, value);
}

void DriveNode::take_controlword(std::uint16_t word) noexcept {
  refresh_settings();
  const State before = power_.state();
  const std::uint16_t last = objects_.controlword.get();
  const bool was_halted = halted();
  const bool was_leaving = power_.leaving();
  power_.command(
      word, {objects_.quick_stop_option.get(), objects_.shutdown_option.get(), objects_.disable_option.get()},
      cause_gone());
  objects_.controlword.set(word);
  halt_ = (word & cia402::controlword::kHalt) != 0;
  if (before == State::kFault && power_.state() != before) reset_fault();
  state_changed(before);
  if (power_.state() == State::kOperationEnabled) {
    command_operation(last, word, was_halted, was_leaving && before == power_.state());
  }
  update_statusword();
}

void DriveNode::command_operation(std::uint16_t last, std::uint16_t word, bool was_halted,
                                  bool was_leaving) noexcept {
  if (power_.leaving()) {
    if (!was_leaving) leave_operation(was_halted);
    return;
  }
  if (was_leaving || (was_halted && !halted())) {
    law_.restart();
    settle_mode() ? mode_->enter(stop_.motion()) : mode_->resume(stop_.motion());
  }
  if (halted() && !was_halted) stop(objects_.halt_option.get());
  mode_->controlword(last, word);
}

Motion DriveNode::present_motion() const noexcept {
  // From the demand when the motor follows it, which keeps the torque steady; else from where the motor is.
  if (power_.powered() && demand_.loop == Demand::Loop::kPosition && !following_error_) {
    return {demand_.position, demand_.velocity};
  }
  const double velocity = std::abs(feedback_.motor_velocity) < kStandstill ? 0 : feedback_.motor_velocity;
  return {feedback_.motor_position, velocity};
}

double DriveNode::torque_offset() const noexcept {
  return mode_->takes_offsets() ? objects_.torque_offset.get() * settings_.per_mille : 0;
}

void DriveNode::stop(int option) noexcept {
  law_.restart();
  stop_.begin(Stop::method_of(option), present_motion(), torque_offset(), settings_);
}

void DriveNode::leave_operation(bool was_halted) noexcept {
  const Motion from = present_motion();
  const bool at_rest = from.velocity == 0 && std::abs(feedback_.motor_velocity) < kStandstill;
  if (!was_halted || !stop_.at_rest()) stop(static_cast<int>(Stop::Method::kSlowDownRamp));
  if (at_rest) stop_ended();
}

void DriveNode::stop_ended() noexcept {
  const State before = power_.state();
  power_.stopped(objects_.quick_stop_option.get());
  state_changed(before);
}

void DriveNode::state_changed(State before) noexcept {
  const State now = power_.state();
  if (now == before) return;
  refresh_settings();
  if (!power_.stopping() && settle_mode()) announce(objects_.mode_display.entry());
  if (now == State::kOperationEnabled) {
    law_.restart();
    // Enabling starts from standstill where the motor is; leaving quick stop goes on from its ramp.
    mode_->enter(before == State::kQuickStopActive ? stop_.motion() : Motion{feedback_.motor_position, 0});
  }
  if (now == State::kQuickStopActive) stop(objects_.quick_stop_option.get());
  if (now == State::kFaultReactionActive) stop(objects_.fault_reaction_option.get());
  update_statusword();
}

void DriveNode::trip(std::uint16_t code, std::uint8_t register_bits, bool controllable) noexcept {
  raise(code, register_bits);
  if (fault_code_ != 0) return;
  fault_code_ = code;
  objects_.error_code.set(code);
  announce(objects_.error_code.entry());
  const State before = power_.state();
  power_.fault(!controllable || objects_.fault_reaction_option.get() == 0);
  state_changed(before);
}

bool DriveNode::cause_gone() const noexcept {
  if (supervision_.causes() != 0) return false;
  // These two end when the master is heard again; all others are over once the torque is off.
  const bool awaits_master =
      fault_code_ == drive_fault::kHeartbeatLost || fault_code_ == drive_fault::kRpdoTimeout;
  return !awaits_master || !active(fault_code_);
}

void DriveNode::reset_fault() noexcept {
  for (const Supervision::Cause& cause : Supervision::kCauses) clear(cause.code);
  for (const std::uint16_t code : drive_fault::kOverWithoutTorque) clear(code);
  clear(fault_code_);
  fault_code_ = 0;
  objects_.error_code.set(0);
  announce(objects_.error_code.entry());
}

void DriveNode::on_sync() noexcept {
  objects_.cycle_counter.set(static_cast<std::uint16_t>(objects_.cycle_counter.get() + 1));
  publish();
}

void DriveNode::on_connection_lost(std::uint16_t error_code) noexcept {
  const State before = power_.state();
  switch (objects_.abort_connection_option.get()) {
    case 1:
      return trip(error_code != 0 ? error_code : drive_fault::kCommunication, error_register::kCommunication);
    case 2:
      power_.disable_voltage();
      break;
    case 3:
      power_.quick_stop(objects_.quick_stop_option.get());
      break;
    default:
      return;
  }
  state_changed(before);
}

void DriveNode::on_reset() noexcept {
  power_.reset();
  fault_code_ = 0;
  halt_ = false;
  following_error_for_ = blocked_for_ = torque_ = 0;
  following_error_ = torque_limited_ = speed_limited_ = false;
  supervision_.reset();
  motion_.zero = 0;
  modes_.homing.forget();
  objects_.error_code.set(0);
  objects_.cycle_counter.set(0);
  objects_.stiffness_actual.set(objects_.stiffness.get());
  objects_.damping_actual.set(objects_.damping.get());
  settings_stale_ = true;
  refresh_settings();
  requested_mode_ = static_cast<Mode>(objects_.mode.get());
  static_cast<void>(settle_mode());
  unpowered_step();
  unpublished_ = true;
  update_statusword();
}

}  // namespace walkman::nodes
