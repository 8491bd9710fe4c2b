#include "emulator/nodes/drive_node.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "emulator/nodes/wire_units.h"

namespace walkman::nodes {

using cia402::Mode;
using cia402::State;

namespace {

// 603Fh and EMCY codes of the drive's own supervision.
constexpr std::uint16_t kBoardTemperature = 0x4210;
constexpr std::uint16_t kMotorTemperature = 0x4310;
constexpr std::uint16_t kFollowingError = 0x8611;
constexpr std::uint16_t kCommunication = 0x8100;
constexpr std::uint16_t kHeartbeatLost = 0x8130;
constexpr std::uint16_t kRpdoTimeout = 0x8250;

constexpr std::uint16_t kWarningBit = 1U << 7U;
constexpr std::uint16_t kTargetReachedBit = 1U << 10U;
constexpr std::uint16_t kInternalLimitBit = 1U << 11U;
constexpr std::uint16_t kFollowsBit = 1U << 12U;
constexpr std::uint16_t kFollowingErrorBit = 1U << 13U;

const DriveParameters& checked(const DriveParameters& p) {
  const bool positive = p.rated_torque > 0 && p.peak_torque > 0 && p.spring_constant > 0 &&
                        p.motor_inertia > 0 && p.position_bandwidth_hz > 0 && p.max_velocity > 0 &&
                        p.interpolation_ms > 0;
  if (!positive || p.sync_divider < 1 || p.sync_divider > 240 || !(p.lower <= p.upper)) {
    throw std::runtime_error(
        "drive " + p.name +
        ": rating, limit or divider out of range, expected positive ratings, lower <= upper, "
        "divider 1 to 240");
  }
  return p;
}

}  // namespace

DriveNode::DriveNode(const DriveParameters& parameters)
    : CanopenSlave({parameters.node_id, kServoDriveType, parameters.name, 1, parameters.serial}),
      parameters_(checked(parameters)),
      objects_(objects(), parameters_),
      set_point_(parameters_.max_velocity),
      law_(parameters_.motor_inertia, parameters_.spring_constant, parameters_.position_bandwidth_hz) {
  connect_hooks();
  configure_pdos(drive_rpdos(parameters_), drive_tpdos(parameters_));
}

void DriveNode::connect_hooks() {
  objects_.controlword.on_write([this](std::uint16_t word) -> Verdict {
    take_controlword(word);
    return std::nullopt;
  });
  objects_.mode.on_write([this](std::int8_t value) { return take_mode(value); });
  objects_.target_position.on_write([this](std::int32_t target) -> Verdict {
    take_target(target);
    return std::nullopt;
  });
  objects_.max_velocity.on_write([this](std::uint32_t value) -> Verdict {
    set_point_.set_max_velocity(value * kMicro);
    return std::nullopt;
  });
}

double DriveNode::control(const ServoFeedback& feedback, double dt) noexcept {
  feedback_ = feedback;
  power_.ready();
  supervise();
  double torque = 0;
  if (power_.powered()) {
    set_point_.step(dt);
    watch_following_error(dt);
    torque = limited(law());
    const State before = power_.state();
    if (power_.stopping() && !set_point_.braking()) power_.stopped(objects_.quick_stop_option.get());
    state_changed(before);
    if (!power_.powered()) torque = 0;
  } else {
    hold_here();
    torque_limited_ = position_limited_ = following_error_ = false;
    following_error_for_ = 0;
  }
  publish(torque);
  return torque;
}

double DriveNode::law() noexcept {
  const double per_mille = parameters_.rated_torque * kMilli;
  const double offset = objects_.torque_offset.get() * per_mille;
  if (power_.stopping() || halted() || mode() == Mode::kCyclicSynchronousPosition) {
    return law_.position(set_point_.position(), set_point_.velocity(), feedback_) + offset;
  }
  if (mode() == Mode::kImpedance) {
    return law_.impedance(set_point_.position(), objects_.stiffness_actual.get() * kMilli,
                          objects_.damping_actual.get() * kMilli, offset, feedback_);
  }
  return law_.torque(objects_.target_torque.get() * per_mille + offset, feedback_);
}

double DriveNode::limited(double torque) noexcept {
  const double limit =
      std::min(parameters_.peak_torque, objects_.max_torque.get() * kMilli * parameters_.rated_torque);
  torque_limited_ = !(std::abs(torque) <= limit);
  if (std::isnan(torque)) return 0;
  return std::clamp(torque, -limit, limit);
}

void DriveNode::supervise() noexcept {
  const double motor = feedback_.motor_temperature_c;
  const double board = feedback_.board_temperature_c;
  const double trip_at = objects_.temperature_trip.get() * kDeci;
  warning_ = std::max(motor, board) >= objects_.temperature_warning.get() * kDeci;
  if (motor >= trip_at) trip(kMotorTemperature, error_register::kTemperature);
  if (board >= trip_at) trip(kBoardTemperature, error_register::kTemperature);
}

void DriveNode::watch_following_error(double dt) noexcept {
  const bool watched =
      power_.state() == State::kOperationEnabled && mode() == Mode::kCyclicSynchronousPosition;
  const double error = set_point_.position() - feedback_.motor_position;
  const std::uint32_t window = objects_.following_error_window.get();
  following_error_ = watched && window != UINT32_MAX && std::abs(error) > window * kMicro;
  following_error_for_ = following_error_ ? following_error_for_ + dt : 0;
  if (following_error_for_ > objects_.following_error_time.get() * kMilli) {
    trip(kFollowingError, error_register::kProfile);
  }
}

void DriveNode::trip(std::uint16_t code, std::uint8_t register_bits) noexcept {
  raise(code, register_bits);
  if (fault_code_ != 0) return;
  fault_code_ = code;
  objects_.error_code.set(code);
  signal_change(objects_.error_code.entry());
  const State before = power_.state();
  power_.fault(objects_.fault_reaction_option.get() == 0);
  state_changed(before);
}

bool DriveNode::cause_gone() const noexcept {
  const double hottest = std::max(feedback_.motor_temperature_c, feedback_.board_temperature_c);
  if (hottest >= objects_.temperature_trip.get() * kDeci) return false;
  // These two end when the master is heard again; all others are over once the torque is off.
  const bool awaits_master = fault_code_ == kHeartbeatLost || fault_code_ == kRpdoTimeout;
  return !awaits_master || !active(fault_code_);
}

void DriveNode::take_controlword(std::uint16_t word) noexcept {
  const State before = power_.state();
  const bool was_halted = halted();
  power_.command(word, objects_.quick_stop_option.get(), cause_gone());
  objects_.controlword.set(word);
  if (before == State::kFault && power_.state() != before) {
    for (const std::uint16_t code : {kBoardTemperature, kMotorTemperature, kFollowingError, kCommunication})
      clear(code);
    clear(fault_code_);
    fault_code_ = 0;
    objects_.error_code.set(0);
    signal_change(objects_.error_code.entry());
  }
  state_changed(before);
  if (!was_halted && halted() && before == State::kOperationEnabled) brake(objects_.halt_option.get());
  if (was_halted && !halted() && power_.state() == State::kOperationEnabled &&
      mode() != Mode::kCyclicSynchronousPosition) {
    hold_here();
  }
  update_statusword();
}

bool DriveNode::halted() const noexcept {
  return power_.state() == State::kOperationEnabled &&
         (objects_.controlword.get() & cia402::controlword::kHalt) != 0;
}

void DriveNode::state_changed(State before) noexcept {
  const State now = power_.state();
  if (now == before) return;
  if (now == State::kOperationEnabled) hold_here();
  if (now == State::kQuickStopActive) brake(objects_.quick_stop_option.get());
  if (now == State::kFaultReactionActive) brake(objects_.fault_reaction_option.get());
  update_statusword();
}

void DriveNode::hold_here() noexcept {
  set_point_.hold(mode() == Mode::kImpedance ? feedback_.link_position : feedback_.motor_position);
}

void DriveNode::brake(int option) noexcept {
  const bool slow = option == 1 || option == 5;
  const double deceleration =
      (slow ? objects_.deceleration.get() : objects_.quick_stop_deceleration.get()) * kMicro;
  // From the demand when the motor follows it, which keeps the torque steady; else from where the motor is.
  if (mode() == Mode::kCyclicSynchronousPosition && !following_error_) {
    set_point_.brake(set_point_.position(), set_point_.velocity(), deceleration);
  } else {
    set_point_.brake(feedback_.motor_position, feedback_.motor_velocity, deceleration);
  }
}

Verdict DriveNode::take_mode(std::int8_t value) noexcept {
  const auto wanted = static_cast<Mode>(value);
  if (wanted == Mode::kNone) return std::nullopt;  // no change
  if (wanted != Mode::kCyclicSynchronousPosition && wanted != Mode::kCyclicSynchronousTorque &&
      wanted != Mode::kImpedance) {
    return SdoAbort::kValue;
  }
  if (wanted == mode()) return std::nullopt;
  objects_.mode_display.set(value);
  if (power_.state() == State::kOperationEnabled && !halted()) hold_here();
  update_statusword();
  return std::nullopt;
}

void DriveNode::take_target(std::int32_t target) noexcept {
  if (power_.state() != State::kOperationEnabled || halted()) return;
  const std::int32_t inside = std::clamp(target, objects_.lower_limit.get(), objects_.upper_limit.get());
  position_limited_ = inside != target;
  set_point_.move_to(inside * kMicro, interpolation_period());
}

double DriveNode::interpolation_period() const noexcept {
  return objects_.interpolation_value.get() * std::pow(10.0, objects_.interpolation_exponent.get());
}

void DriveNode::publish(double torque) noexcept {
  const double rated = parameters_.rated_torque;
  objects_.position_demand.set(to_wire<std::int32_t>(set_point_.position(), kMicro));
  objects_.position_actual.set(to_wire<std::int32_t>(feedback_.motor_position, kMicro));
  objects_.velocity_actual.set(to_wire<std::int32_t>(feedback_.motor_velocity, kMicro));
  objects_.link_position.set(to_wire<std::int32_t>(feedback_.link_position, kMicro));
  objects_.following_error.set(
      to_wire<std::int32_t>(set_point_.position() - feedback_.motor_position, kMicro));
  objects_.torque_demand.set(to_wire<std::int16_t>(torque / rated, kMilli));
  objects_.torque_actual.set(to_wire<std::int16_t>(feedback_.spring_torque / rated, kMilli));
  objects_.deflection.set(to_wire<std::int32_t>(feedback_.motor_position - feedback_.link_position, kMicro));
  objects_.spring_torque.set(to_wire<std::int32_t>(feedback_.spring_torque, kMilli));
  objects_.motor_temperature.set(to_wire<std::int16_t>(feedback_.motor_temperature_c, kDeci));
  objects_.board_temperature.set(to_wire<std::int16_t>(feedback_.board_temperature_c, kDeci));
  objects_.temperature_compact.set(to_wire<std::int8_t>(feedback_.motor_temperature_c, 1.0));
  objects_.supply_voltage.set(to_wire<std::uint32_t>(feedback_.supply_voltage, kMilli));
  update_statusword();
}

void DriveNode::update_statusword() noexcept {
  std::uint16_t word = status_bits(power_.state());
  if (warning_) word |= kWarningBit;
  if (halted() && !set_point_.braking()) word |= kTargetReachedBit;
  if (power_.powered() && (torque_limited_ || position_limited_ || set_point_.limited()))
    word |= kInternalLimitBit;
  if (power_.state() == State::kOperationEnabled && !halted()) word |= kFollowsBit;
  if (following_error_) word |= kFollowingErrorBit;
  if (word == objects_.statusword.get()) return;
  objects_.statusword.set(word);
  signal_change(objects_.statusword.entry());
}

void DriveNode::on_sync() noexcept {
  objects_.cycle_counter.set(static_cast<std::uint16_t>(objects_.cycle_counter.get() + 1));
}

void DriveNode::on_connection_lost(std::uint16_t error_code) noexcept {
  const State before = power_.state();
  switch (objects_.abort_connection_option.get()) {
    case 1:
      return trip(error_code != 0 ? error_code : kCommunication, error_register::kCommunication);
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
  following_error_for_ = 0;
  following_error_ = torque_limited_ = position_limited_ = warning_ = false;
  objects_.error_code.set(0);
  objects_.mode_display.set(objects_.mode.get());
  objects_.cycle_counter.set(0);
  objects_.stiffness_actual.set(objects_.stiffness.get());
  objects_.damping_actual.set(objects_.damping.get());
  set_point_.set_max_velocity(objects_.max_velocity.get() * kMicro);
  hold_here();
  update_statusword();
}

}  // namespace walkman::nodes
