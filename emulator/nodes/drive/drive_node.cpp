#include "emulator/nodes/drive/drive_node.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "emulator/nodes/cia301/object_table.h"
#include "emulator/nodes/drive/drive_table.h"
#include "emulator/nodes/drive/operating_mode.h"

namespace walkman::nodes {

using cia402::Mode;
using cia402::State;

namespace {

/// 603Fh and EMCY codes for the connection with the master; those for the drive's measurements are in
/// `Supervision`, those for its motion in `MotionWatch`.
namespace drive_fault {

constexpr std::uint16_t kCommunication = 0x8100;
constexpr std::uint16_t kHeartbeatLost = 0x8130;
constexpr std::uint16_t kRpdoTimeout = 0x8250;

/// Codes of faults that end when the torque is off.
constexpr std::array<std::uint16_t, 4> kOverWithoutTorque{
    MotionWatch::kBlocked, kCommunication, MotionWatch::kFollowingError, MotionWatch::kPositionLimit};

}  // namespace drive_fault

// A motor slower than this counts as standing still when its motion is handed over, rad/s.
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

bool finite(double value) noexcept { return std::abs(value) <= 1e9; }

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
  objects_.controlword.on_write([this](std::uint16_t word) -> Refusal {
    take_controlword(word);
    return std::nullopt;
  });
  objects_.mode.on_write([this](std::int8_t value) { return take_mode(value); });
}

void DriveNode::forward_targets() {
  const auto forward = [this](Object<std::int32_t>& object, TargetObject target) {
    object.on_write([this, target](std::int32_t value) -> Refusal {
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

Refusal DriveNode::take_mode(std::int8_t value) noexcept {
  const auto wanted = static_cast<Mode>(value);
  if (wanted == Mode::kNone) return std::nullopt;  // no change
  if (modes_.find(wanted) == nullptr) return SdoAbort::kValue;
  requested_mode_ = wanted;
  // A stop is not interrupted; the mode becomes active when it has ended.
  if (power_.stopping() || !take_up_mode()) return std::nullopt;
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

bool DriveNode::take_up_mode() noexcept {
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
    take_up_mode() ? mode_->enter(stop_.motion()) : mode_->resume(stop_.motion());
  }
  if (halted() && !was_halted) stop(objects_.halt_option.get());
  mode_->controlword(last, word);
}

Motion DriveNode::present_motion() const noexcept {
  // From the demand if the motor follows it, which keeps the torque steady; else from the motor's position.
  if (power_.powered() && demand_.loop == Demand::Loop::kPosition && !watch_.following_error()) {
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
  if (!power_.stopping() && take_up_mode()) announce(objects_.mode_display.entry());
  if (now == State::kOperationEnabled) {
    law_.restart();
    // Enabling starts from standstill at the motor's position; leaving quick stop continues from its ramp.
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
  // These two end when the master is heard again; all others end when the torque is off.
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
  torque_ = 0;
  torque_limited_ = speed_limited_ = false;
  watch_.rest();
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
  static_cast<void>(take_up_mode());
  unpowered_step();
  unpublished_ = true;
  update_statusword();
}

double DriveNode::control(const ServoFeedback& feedback, double dt) noexcept {
  power_.ready();
  refresh_settings();
  const bool needs_supply = power_.powered() || power_.state() == State::kSwitchedOn;
  supervision_.step(feedback, settings_, needs_supply, dt);
  take_feedback(feedback);
  if (supervision_.causes() != 0) report_causes();
  torque_ = power_.powered() ? powered_step(dt) : unpowered_step();
  unpublished_ = true;
  if (!ever_published_) publish();
  update_statusword();
  return torque_;
}

void DriveNode::take_feedback(const ServoFeedback& feedback) noexcept {
  if ((supervision_.causes() & Supervision::kEncoders) == 0) {
    feedback_ = feedback;
    return;
  }
  const ServoFeedback last = feedback_;
  feedback_ = feedback;
  // Loops and values on the wire keep the last valid reading.
  if (!finite(feedback.motor_position)) feedback_.motor_position = last.motor_position;
  if (!finite(feedback.motor_velocity)) feedback_.motor_velocity = 0;
  if (!finite(feedback.link_position)) feedback_.link_position = last.link_position;
  if (!finite(feedback.link_velocity)) feedback_.link_velocity = 0;
  if (!finite(feedback.spring_torque)) feedback_.spring_torque = last.spring_torque;
}

void DriveNode::report_causes() noexcept {
  for (const Supervision::Cause& cause : Supervision::kCauses) {
    if ((supervision_.causes() & cause.bit) != 0)
      trip(cause.code, cause.register_bits, !cause.uncontrollable);
  }
}

double DriveNode::unpowered_step() noexcept {
  const bool of_link = mode_ == &modes_.impedance;
  demand_ = {of_link ? Demand::Loop::kImpedance : Demand::Loop::kPosition,
             of_link ? feedback_.link_position : feedback_.motor_position, 0, 0};
  torque_limited_ = speed_limited_ = false;
  watch_.rest();
  return 0;
}

double DriveNode::powered_step(double dt) noexcept {
  const bool driving = mode_drives();
  if (driving) {
    demand_ = mode_->step(dt);
  } else {
    if (power_.state() == State::kOperationEnabled) mode_->halted(dt);
    demand_ = stop_.step(feedback_, dt);
  }
  const State before = power_.state();
  if (before == State::kOperationEnabled) {
    const std::uint16_t wrong =
        watch_.step(demand_, mode_->follows_position(), torque_limited_, mode_drives(), dt);
    if (wrong != 0) trip(wrong, error_register::kProfile);
  } else {
    watch_.rest();
  }
  if (power_.state() != before) {
    if (!power_.powered()) return unpowered_step();
    demand_ = stop_.demand();
  }
  const double torque = limited(law(dt));
  if (power_.stopping() && stop_.at_rest()) stop_ended();
  return power_.powered() ? torque : unpowered_step();
}

double DriveNode::law(double dt) noexcept {
  speed_limited_ = false;
  switch (demand_.loop) {
    case Demand::Loop::kPosition:
      return law_.position(demand_.position, demand_.velocity, feedback_, dt) + demand_.torque;
    case Demand::Loop::kVelocity:
      return law_.velocity(demand_.velocity, feedback_, dt) + demand_.torque;
    case Demand::Loop::kTorque:
      return speed_limited(law_.torque(demand_.torque, feedback_, dt));
    case Demand::Loop::kImpedance:
      return law_.impedance(demand_.position, settings_.stiffness, settings_.damping, demand_.torque,
                            feedback_, dt);
  }
  return 0;
}

double DriveNode::speed_limited(double torque) noexcept {
  const double inside = std::clamp(torque, law_.torque_at(-settings_.max_velocity, feedback_),
                                   law_.torque_at(settings_.max_velocity, feedback_));
  speed_limited_ = inside != torque;
  return inside;
}

double DriveNode::limited(double torque) noexcept {
  const bool whole = !mode_drives() && stop_.whole_torque();
  const double limit = whole ? settings_.peak_torque : settings_.torque_limit;
  torque_limited_ = !(std::abs(torque) <= limit);
  if (std::isnan(torque)) return 0;
  const double inside = std::clamp(torque, -limit, limit);
  law_.limited(torque_limited_, inside);
  return inside;
}

void DriveNode::publish() noexcept {
  if (!unpublished_) return;
  unpublished_ = false;
  ever_published_ = true;
  objects_.publish_motion(demand_, feedback_, motion_.zero, parameters_.motor_encoder_step);
  const bool of_torque = power_.powered() && demand_.loop == Demand::Loop::kTorque;
  const double limit = settings_.torque_limit;
  objects_.publish_electronics(feedback_, of_torque ? std::clamp(demand_.torque, -limit, limit) : torque_,
                               torque_, parameters_);
}

std::uint16_t DriveNode::mode_bits() const noexcept {
  const State state = power_.state();
  if (state == State::kQuickStopActive) return stop_.at_rest() ? status_bit::kTargetReached : 0;
  if (state != State::kOperationEnabled || power_.leaving()) return 0;
  if (!halted()) return mode_->status();
  return static_cast<std::uint16_t>(mode_->halted_status() |
                                    (stop_.at_rest() ? status_bit::kTargetReached : 0));
}

void DriveNode::update_statusword() noexcept {
  std::uint16_t word = status_bits(power_.state()) | mode_bits();
  if (supervision_.warning()) word |= status_bit::kWarning;
  if (!supervision_.supplied()) word &= static_cast<std::uint16_t>(~status_bit::kVoltage);
  const bool target_limited = mode_drives() && mode_->limited();
  if (power_.powered() && (torque_limited_ || speed_limited_ || target_limited)) {
    word |= status_bit::kInternalLimit;
  }
  if (watch_.following_error()) word |= status_bit::kMode13;
  if (word == objects_.statusword.get()) return;
  objects_.statusword.set(word);
  announce(objects_.statusword.entry());
}

void DriveNode::announce(const Entry& entry) noexcept {
  publish();
  signal_change(entry);
}

}  // namespace walkman::nodes
