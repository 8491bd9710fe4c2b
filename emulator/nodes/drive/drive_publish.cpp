// What a drive shows on the wire: the one place where measurements and demands get the wire's units.

#include "emulator/nodes/drive/drive_node.h"
#include "emulator/nodes/cia301/object_table.h"

namespace walkman::nodes {

using cia402::State;

void DriveNode::publish() noexcept {
  if (!unpublished_) return;
  unpublished_ = false;
  ever_published_ = true;
  publish_motion();
  publish_measurements();
}

void DriveNode::publish_motion() noexcept {
  const double motor = feedback_.motor_position - motion_.zero;
  const double link = feedback_.link_position - motion_.zero;
  const bool of_link = demand_.loop == Demand::Loop::kImpedance;
  const bool of_position = of_link || demand_.loop == Demand::Loop::kPosition;
  const double demand = of_position ? demand_.position : feedback_.motor_position;
  const double followed = of_link ? feedback_.link_position : feedback_.motor_position;
  objects_.position_demand.set(to_wire<std::int32_t>(demand - motion_.zero, kMicro));
  objects_.position_actual.set(to_wire<std::int32_t>(motor, kMicro));
  objects_.position_increments.set(to_wire<std::int32_t>(motor, parameters_.motor_encoder_step));
  objects_.link_position.set(to_wire<std::int32_t>(link, kMicro));
  objects_.following_error.set(to_wire<std::int32_t>(demand - followed, kMicro));
  objects_.deflection.set(to_wire<std::int32_t>(motor - link, kMicro));
  objects_.velocity_demand.set(to_wire<std::int32_t>(demand_.velocity, kMicro));
  objects_.velocity_actual.set(to_wire<std::int32_t>(feedback_.motor_velocity, kMicro));
  objects_.link_velocity.set(to_wire<std::int32_t>(feedback_.link_velocity, kMicro));
}

void DriveNode::publish_measurements() noexcept {
  const double rated = parameters_.rated_torque;
  const bool of_torque = power_.powered() && demand_.loop == Demand::Loop::kTorque;
  const double limit = settings_.torque_limit;
  const double demand = of_torque ? std::clamp(demand_.torque, -limit, limit) : torque_;
  objects_.torque_demand.set(to_wire<std::int16_t>(demand / rated, kMilli));
  objects_.torque_actual.set(to_wire<std::int16_t>(feedback_.spring_torque / rated, kMilli));
  objects_.spring_torque.set(to_wire<std::int32_t>(feedback_.spring_torque, kMilli));
  // Without a current sensor: torque over the torque constant, which is rated torque over rated current.
  const bool measured = !std::isnan(feedback_.motor_current);
  const double current = measured ? feedback_.motor_current / parameters_.rated_current : torque_ / rated;
  objects_.current_actual.set(to_wire<std::int16_t>(current, kMilli));
  objects_.motor_temperature.set(to_wire<std::int16_t>(feedback_.motor_temperature_c, kDeci));
  objects_.board_temperature.set(to_wire<std::int16_t>(feedback_.board_temperature_c, kDeci));
  objects_.temperature_compact.set(to_wire<std::int8_t>(feedback_.motor_temperature_c, 1.0));
  objects_.supply_voltage.set(to_wire<std::uint32_t>(feedback_.supply_voltage, kMilli));
  objects_.digital_inputs.set(feedback_.digital_inputs);
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
  if (following_error_) word |= status_bit::kMode13;
  if (word == objects_.statusword.get()) return;
  objects_.statusword.set(word);
  announce(objects_.statusword.entry());
}

void DriveNode::announce(const Entry& entry) noexcept {
  publish();
  signal_change(entry);
}

}  // namespace walkman::nodes
