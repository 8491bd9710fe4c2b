#include "emulator/nodes/drive/drive_objects.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "drivers/canopen/objects.h"
#include "emulator/nodes/cia301/object_table.h"
#include "emulator/nodes/drive/drive_table.h"

namespace walkman::nodes {

namespace object = canopen::object;

namespace {

constexpr std::uint32_t kMostProfileVelocity = 1'000'000;  // µrad/s, factory setting of 6081h

// Gains may be raised to these multiples of the factory gains: the loops, sampled at 4 kHz with velocities
// filtered over 2 ms, remain stable.
constexpr double kMostP = 4;
constexpr double kMostD = 3;
constexpr double kMostIntegral = 50;         // 1/s, relative to the factory P
constexpr std::int64_t kMostTorqueP = 4000;  // per mille
constexpr std::int64_t kMostTorqueI = 100'000;

}  // namespace

DriveObjects::DriveObjects(ObjectDictionary& dictionary, const DriveParameters& parameters,
                           const ServoGains& factory)
    : dictionary_(dictionary) {
  dictionary.add(drive_table());
  bind_manufacturer_objects(parameters);
  bind_impedance(parameters);
  bind_gains(parameters, factory);
  bind_state_objects();
  bind_position_objects(parameters);
  bind_profile_objects(parameters);
  bind_cyclic_objects(parameters);
  bind_velocity_objects();
  bind_torque_objects(parameters);
}

void DriveObjects::on_setting(const std::function<void()>& hook) {
  for (Entry* entry : settings_) {
    entry->write_hook = [check = std::move(entry->write_hook), hook](std::uint32_t raw) -> Refusal {
      if (check) {
        if (const Refusal refused = check(raw)) return refused;
      }
      hook();
      return std::nullopt;
    };
  }
}

void DriveObjects::on_measurement_read(const std::function<void()>& hook) {
  for (Entry* entry : measurements_) {
    entry->read_hook = [hook]() -> Refusal {
      hook();
      return std::nullopt;
    };
  }
}

void DriveObjects::publish_motion(const Demand& demand, const ServoFeedback& feedback, double zero,
                                  double increment) noexcept {
  const double motor = feedback.motor_position - zero;
  const double link = feedback.link_position - zero;
  const bool of_link = demand.loop == Demand::Loop::kImpedance;
  const bool of_position = of_link || demand.loop == Demand::Loop::kPosition;
  const double asked = of_position ? demand.position : feedback.motor_position;
  const double followed = of_link ? feedback.link_position : feedback.motor_position;
  position_demand.set(to_wire<std::int32_t>(asked - zero, kMicro));
  position_actual.set(to_wire<std::int32_t>(motor, kMicro));
  position_increments.set(to_wire<std::int32_t>(motor, increment));
  link_position.set(to_wire<std::int32_t>(link, kMicro));
  following_error.set(to_wire<std::int32_t>(asked - followed, kMicro));
  deflection.set(to_wire<std::int32_t>(motor - link, kMicro));
  velocity_demand.set(to_wire<std::int32_t>(demand.velocity, kMicro));
  velocity_actual.set(to_wire<std::int32_t>(feedback.motor_velocity, kMicro));
  link_velocity.set(to_wire<std::int32_t>(feedback.link_velocity, kMicro));
}

void DriveObjects::publish_electronics(const ServoFeedback& feedback, double torque_asked,
                                       double motor_torque, const DriveParameters& parameters) noexcept {
  const double rated = parameters.rated_torque;
  torque_demand.set(to_wire<std::int16_t>(torque_asked / rated, kMilli));
  torque_actual.set(to_wire<std::int16_t>(feedback.spring_torque / rated, kMilli));
  spring_torque.set(to_wire<std::int32_t>(feedback.spring_torque, kMilli));
  const bool measured = !std::isnan(feedback.motor_current);
  const double current = measured ? feedback.motor_current / parameters.rated_current : motor_torque / rated;
  current_actual.set(to_wire<std::int16_t>(current, kMilli));
  motor_temperature.set(to_wire<std::int16_t>(feedback.motor_temperature_c, kDeci));
  board_temperature.set(to_wire<std::int16_t>(feedback.board_temperature_c, kDeci));
  temperature_compact.set(to_wire<std::int8_t>(feedback.motor_temperature_c, 1.0));
  supply_voltage.set(to_wire<std::uint32_t>(feedback.supply_voltage, kMilli));
  digital_inputs.set(feedback.digital_inputs);
}

void DriveObjects::bind_manufacturer_objects(const DriveParameters& p) {
  dictionary_.object<std::uint32_t>(0x2000, 2).factory(p.model_hash);
  dictionary_.object<std::uint16_t>(0x2000, 3).factory(p.joint_number);
  dictionary_.object<std::uint16_t>(0x2000, 4).factory(p.bus_number);
  deflection = measurement<std::int32_t>(object::kSeriesElastic, 1);
  spring_torque = measurement<std::int32_t>(object::kSeriesElastic, 2);
  dictionary_.object<std::uint32_t>(object::kSeriesElastic, 3)
      .factory(to_wire<std::uint32_t>(p.spring_constant, kMilli));
  motor_temperature = measurement<std::int16_t>(object::kTemperature, 1);
  board_temperature = measurement<std::int16_t>(object::kTemperature, 2);
  temperature_warning = setting<std::int16_t>(object::kTemperature, 3);
  temperature_trip = setting<std::int16_t>(object::kTemperature, 4);
  temperature_compact = measurement<std::int8_t>(object::kTemperatureCompact, 1);
  lowest_supply = setting<std::uint32_t>(0x2032, 1).factory(to_wire<std::uint32_t>(p.lowest_supply, kMilli));
  highest_supply =
      setting<std::uint32_t>(0x2032, 2).factory(to_wire<std::uint32_t>(p.highest_supply, kMilli));
  cycle_counter = dictionary_.object<std::uint16_t>(object::kCycleCounter, 1);
}

void DriveObjects::bind_impedance(const DriveParameters& p) {
  // Factory impedance: a fifth of the spring's stiffness, damping ratio 0.7 for the reflected motor inertia.
  const double default_stiffness = 0.2 * p.spring_constant;
  const double default_damping = 1.4 * std::sqrt(p.motor_inertia * default_stiffness);
  const auto k = to_wire<std::uint32_t>(default_stiffness, kMilli);
  const auto damp = to_wire<std::uint32_t>(default_damping, kMilli);
  stiffness = setting<std::uint32_t>(object::kImpedance, 1).factory(k);
  damping = setting<std::uint32_t>(object::kImpedance, 2).factory(damp);
  stiffness_actual = dictionary_.object<std::uint32_t>(object::kImpedance, 3).factory(k);
  damping_actual = dictionary_.object<std::uint32_t>(object::kImpedance, 4).factory(damp);
  stiffness_pdo = setting<std::uint16_t>(0x2011, 1).factory(to_wire<std::uint16_t>(default_stiffness, 0.1));
  damping_pdo = setting<std::uint16_t>(0x2011, 2).factory(to_wire<std::uint16_t>(default_damping, 0.01));
  stiffness.on_write([this](std::uint32_t value) -> Refusal {
    stiffness_actual.set(value);
    return std::nullopt;
  });
  damping.on_write([this](std::uint32_t value) -> Refusal {
    damping_actual.set(value);
    return std::nullopt;
  });
  stiffness_pdo.on_write([this](std::uint16_t value) -> Refusal {
    stiffness_actual.set(std::uint32_t{value} * 100);
    return std::nullopt;
  });
  damping_pdo.on_write([this](std::uint16_t value) -> Refusal {
    damping_actual.set(std::uint32_t{value} * 10);
    return std::nullopt;
  });
}

void DriveObjects::bind_gains(const DriveParameters& p, const ServoGains& factory) {
  const auto bind = [this](std::uint16_t index, const LoopGains& gains, std::array<std::int64_t, 3> most) {
    std::array<Object<std::uint32_t>, 3> objects;
    const std::array<double, 3> values{gains.p, gains.i, gains.d};
    for (std::size_t i = 0; i < 3; ++i) {
      objects[i] = setting<std::uint32_t>(index, static_cast<std::uint8_t>(i + 1))
                       .factory(to_wire<std::uint32_t>(values[i], kMilli))
                       .limits(0, most[i]);
    }
    return objects;
  };
  const auto milli = [](double value) -> std::int64_t { return to_wire<std::uint32_t>(value, kMilli); };
  position_gains = bind(0x2040, factory.position,
                        {milli(kMostP * factory.position.p), milli(kMostIntegral * factory.position.p),
                         milli(kMostD * factory.position.d)});
  velocity_gains = bind(
      0x2041, factory.velocity,
      {milli(kMostD * factory.velocity.p), milli(kMostP * factory.velocity.i), milli(0.5 * p.motor_inertia)});
  torque_gains = bind(0x2042, factory.torque, {kMostTorqueP, kMostTorqueI, milli(kMostD * factory.torque.d)});
}

void DriveObjects::bind_state_objects() {
  ObjectDictionary& d = dictionary_;
  abort_connection_option = d.object<std::int16_t>(object::kAbortConnection);
  error_code = d.object<std::uint16_t>(object::kErrorCode);
  controlword = d.object<std::uint16_t>(object::kControlword);
  statusword = d.object<std::uint16_t>(object::kStatusword);
  quick_stop_option = d.object<std::int16_t>(0x605A);
  shutdown_option = d.object<std::int16_t>(0x605B);
  disable_option = d.object<std::int16_t>(0x605C);
  halt_option = d.object<std::int16_t>(0x605D);
  fault_reaction_option = d.object<std::int16_t>(0x605E);
  mode = d.object<std::int8_t>(object::kMode);
  mode_display = d.object<std::int8_t>(object::kModeDisplay);
  supply_voltage = measurement<std::uint32_t>(0x6079);
  digital_inputs = measurement<std::uint32_t>(0x60FD);
  digital_outputs = d.object<std::uint32_t>(0x60FE, 1);
  output_mask = d.object<std::uint32_t>(0x60FE, 2);
}

void DriveObjects::bind_position_objects(const DriveParameters& p) {
  position_demand = measurement<std::int32_t>(0x6062);
  position_increments = measurement<std::int32_t>(0x6063);
  position_actual = measurement<std::int32_t>(object::kPositionActual);
  following_error_window =
      setting<std::uint32_t>(0x6065).factory(to_wire<std::uint32_t>(p.following_error_window, kMicro));
  following_error_time = setting<std::uint16_t>(0x6066).factory(p.following_error_ms);
  position_window = setting<std::uint32_t>(0x6067);
  position_window_time = setting<std::uint16_t>(0x6068);
  target_position = dictionary_.object<std::int32_t>(object::kTargetPosition);
  link_position = measurement<std::int32_t>(object::kAdditionalPosition, 1);
  link_velocity = measurement<std::int32_t>(0x60E5, 1);
  following_error = measurement<std::int32_t>(0x60F4);
  home_offset = dictionary_.object<std::int32_t>(0x607C);
  homing_method = dictionary_.object<std::int8_t>(0x6098);
  lower_limit = dictionary_.object<std::int32_t>(0x607D, 1).factory(to_wire<std::int32_t>(p.lower, kMicro));
  upper_limit = dictionary_.object<std::int32_t>(0x607D, 2).factory(to_wire<std::int32_t>(p.upper, kMicro));
  lower_limit.on_write([this](std::int32_t value) -> Refusal {
    if (value > upper_limit.get()) return SdoAbort::kMaxBelowMin;
    return std::nullopt;
  });
  upper_limit.on_write([this](std::int32_t value) -> Refusal {
    if (value < lower_limit.get()) return SdoAbort::kMaxBelowMin;
    return std::nullopt;
  });
  dictionary_.object<std::uint32_t>(0x608F, 1).factory(
      to_wire<std::uint32_t>(2 * std::numbers::pi, p.motor_encoder_step));
}

void DriveObjects::bind_profile_objects(const DriveParameters& p) {
  const auto fastest = to_wire<std::uint32_t>(p.max_velocity, kMicro);
  max_velocity = setting<std::uint32_t>(0x607F).factory(fastest).limits(1, fastest);
  max_motor_speed = setting<std::uint32_t>(0x6080).factory(fastest).limits(1, fastest);
  profile_velocity = setting<std::uint32_t>(0x6081).factory(std::min(fastest, kMostProfileVelocity));
  acceleration = setting<std::uint32_t>(0x6083);
  deceleration = setting<std::uint32_t>(0x6084);
  quick_stop_deceleration = setting<std::uint32_t>(0x6085);
}

void DriveObjects::bind_cyclic_objects(const DriveParameters& p) {
  position_offset = dictionary_.object<std::int32_t>(0x60B0);
  velocity_offset = dictionary_.object<std::int32_t>(0x60B1);
  torque_offset = dictionary_.object<std::int16_t>(object::kTorqueOffset);
  interpolation_target = dictionary_.object<std::int32_t>(0x60C1, 1);
  interpolation_value = setting<std::uint8_t>(object::kInterpolationPeriod, 1).factory(p.interpolation_ms);
  interpolation_exponent = setting<std::int8_t>(object::kInterpolationPeriod, 2);
}

void DriveObjects::bind_velocity_objects() {
  velocity_demand = measurement<std::int32_t>(0x606B);
  velocity_actual = measurement<std::int32_t>(object::kVelocityActual);
  velocity_window = setting<std::uint16_t>(0x606D);
  velocity_window_time = setting<std::uint16_t>(0x606E);
  velocity_threshold = setting<std::uint16_t>(0x606F);
  velocity_threshold_time = setting<std::uint16_t>(0x6070);
  target_velocity = dictionary_.object<std::int32_t>(object::kTargetVelocity);
}

void DriveObjects::bind_torque_objects(const DriveParameters& p) {
  target_torque = dictionary_.object<std::int16_t>(object::kTargetTorque);
  const auto peak = to_wire<std::uint16_t>(p.peak_torque / p.rated_torque, kMilli);
  max_torque = setting<std::uint16_t>(object::kMaxTorque).factory(peak);
  max_current = setting<std::uint16_t>(0x6073).factory(peak);
  torque_demand = measurement<std::int16_t>(0x6074);
  dictionary_.object<std::uint32_t>(0x6075).factory(to_wire<std::uint32_t>(p.rated_current, kMilli));
  dictionary_.object<std::uint32_t>(object::kRatedTorque)
      .factory(to_wire<std::uint32_t>(p.rated_torque, kMilli));
  torque_actual = measurement<std::int16_t>(object::kTorqueActual);
  current_actual = measurement<std::int16_t>(0x6078);
  torque_slope = setting<std::uint32_t>(0x6087);
}

}  // namespace walkman::nodes
