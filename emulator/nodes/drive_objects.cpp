#include "emulator/nodes/drive_objects.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "drivers/canopen/objects.h"
#include "drivers/cia402/words.h"
#include "emulator/nodes/wire_units.h"

namespace walkman::nodes {

namespace object = canopen::object;

namespace {

constexpr auto kRo = Access::kReadOnly;
constexpr auto kRw = Access::kReadWrite;
constexpr auto kMap = Mappable::kYes;

// CiA 303-2: prefix exponent, numerator, denominator; 10h is rad, 03h is s, and FAh is 10^-6.
constexpr std::uint32_t kMicroRadian = 0xFA100000;
constexpr std::uint32_t kMicroRadianPerSecond = 0xFA100300;

// 6502h: csp, cst, and the manufacturer's impedance mode.
constexpr std::uint32_t kSupportedModes = 1U << 7U | 1U << 9U | 1U << 16U;

constexpr double kDefaultDeceleration = 10;           // rad/s^2
constexpr double kDefaultQuickStopDeceleration = 40;  // rad/s^2
constexpr std::int16_t kTemperatureWarning = 800;     // 0.1 degC
constexpr std::int16_t kTemperatureTrip = 1000;

/// Limits a choice among some small numbers.
void allow(Object<std::int16_t>& option, std::initializer_list<std::int16_t> values) {
  std::uint32_t allowed = 0;
  for (const std::int16_t value : values) allowed |= 1U << static_cast<unsigned>(value);
  option.limits(std::min(values), std::max(values)).on_write([allowed](std::int16_t value) -> Verdict {
    if ((allowed >> static_cast<unsigned>(value) & 1U) == 0) return SdoAbort::kValue;
    return std::nullopt;
  });
}

void add_count(ObjectDictionary& dictionary, std::uint16_t index, std::uint8_t highest_sub) {
  dictionary.add<std::uint8_t>(index, 0, Access::kConst, highest_sub);
}

}  // namespace

DriveObjects::DriveObjects(ObjectDictionary& dictionary, const DriveParameters& parameters) {
  add_manufacturer_objects(dictionary, parameters);
  add_state_objects(dictionary);
  add_motion_objects(dictionary, parameters);
}

void DriveObjects::add_manufacturer_objects(ObjectDictionary& d, const DriveParameters& p) {
  // Factory impedance: a fifth of the spring's stiffness, damping ratio 0.7 of the reflected motor on it.
  const double default_stiffness = 0.2 * p.spring_constant;
  const double default_damping = 1.4 * std::sqrt(p.motor_inertia * default_stiffness);
  const auto k = to_wire<std::uint32_t>(default_stiffness, kMilli);
  const auto damp = to_wire<std::uint32_t>(default_damping, kMilli);
  add_count(d, object::kImpedance, 4);
  stiffness = d.add<std::uint32_t>(object::kImpedance, 1, kRw, k);
  damping = d.add<std::uint32_t>(object::kImpedance, 2, kRw, damp);
  stiffness_actual = d.add<std::uint32_t>(object::kImpedance, 3, kRo, k);
  damping_actual = d.add<std::uint32_t>(object::kImpedance, 4, kRo, damp);
  add_count(d, 0x2011, 2);
  stiffness_pdo = d.add<std::uint16_t>(0x2011, 1, kRw, to_wire<std::uint16_t>(default_stiffness, 0.1), kMap);
  damping_pdo = d.add<std::uint16_t>(0x2011, 2, kRw, to_wire<std::uint16_t>(default_damping, 0.01), kMap);
  stiffness.on_write([this](std::uint32_t value) -> Verdict {
    stiffness_actual.set(value);
    return std::nullopt;
  });
  damping.on_write([this](std::uint32_t value) -> Verdict {
    damping_actual.set(value);
    return std::nullopt;
  });
  stiffness_pdo.on_write([this](std::uint16_t value) -> Verdict {
    stiffness_actual.set(std::uint32_t{value} * 100);
    return std::nullopt;
  });
  damping_pdo.on_write([this](std::uint16_t value) -> Verdict {
    damping_actual.set(std::uint32_t{value} * 10);
    return std::nullopt;
  });

  add_count(d, object::kSeriesElastic, 3);
  deflection = d.add<std::int32_t>(object::kSeriesElastic, 1, kRo, 0, kMap);
  spring_torque = d.add<std::int32_t>(object::kSeriesElastic, 2, kRo, 0, kMap);
  d.add<std::uint32_t>(object::kSeriesElastic, 3, kRo, to_wire<std::uint32_t>(p.spring_constant, kMilli));
  add_count(d, object::kTemperature, 4);
  motor_temperature = d.add<std::int16_t>(object::kTemperature, 1, kRo, 0, kMap);
  board_temperature = d.add<std::int16_t>(object::kTemperature, 2, kRo, 0, kMap);
  temperature_warning = d.add<std::int16_t>(object::kTemperature, 3, kRw, kTemperatureWarning);
  temperature_trip = d.add<std::int16_t>(object::kTemperature, 4, kRw, kTemperatureTrip);
  add_count(d, object::kTemperatureCompact, 1);
  temperature_compact = d.add<std::int8_t>(object::kTemperatureCompact, 1, kRo, 0, kMap);
  add_count(d, object::kCycleCounter, 1);
  cycle_counter = d.add<std::uint16_t>(object::kCycleCounter, 1, kRo, 0, kMap);
}

void DriveObjects::add_state_objects(ObjectDictionary& d) {
  abort_connection_option = d.add<std::int16_t>(0x6007, 0, kRw, 3);
  allow(abort_connection_option, {0, 1, 2, 3});
  error_code = d.add<std::uint16_t>(object::kErrorCode, 0, kRo, 0, kMap);
  controlword = d.add<std::uint16_t>(object::kControlword, 0, kRw, 0, kMap);
  statusword = d.add<std::uint16_t>(object::kStatusword, 0, kRo, 0, kMap);
  quick_stop_option = d.add<std::int16_t>(0x605A, 0, kRw, 2);
  allow(quick_stop_option, {0, 1, 2, 5, 6});
  // Shutdown and disable operation always cut the torque; the brake then holds.
  auto shutdown_option = d.add<std::int16_t>(0x605B, 0, kRw, 0);
  allow(shutdown_option, {0});
  auto disable_option = d.add<std::int16_t>(0x605C, 0, kRw, 0);
  allow(disable_option, {0});
  halt_option = d.add<std::int16_t>(0x605D, 0, kRw, 1);
  allow(halt_option, {1, 2});
  fault_reaction_option = d.add<std::int16_t>(0x605E, 0, kRw, 2);
  allow(fault_reaction_option, {0, 1, 2});
  constexpr auto kFactoryMode = static_cast<std::int8_t>(cia402::Mode::kCyclicSynchronousPosition);
  mode = d.add<std::int8_t>(object::kMode, 0, kRw, kFactoryMode, kMap);
  mode_display = d.add<std::int8_t>(object::kModeDisplay, 0, kRo, kFactoryMode, kMap);
  d.add<std::uint32_t>(object::kSupportedModes, 0, kRo, kSupportedModes);
  d.add<std::uint32_t>(0x60A8, 0, kRo, kMicroRadian);
  d.add<std::uint32_t>(0x60A9, 0, kRo, kMicroRadianPerSecond);
}

void DriveObjects::add_motion_objects(ObjectDictionary& d, const DriveParameters& p) {
  position_demand = d.add<std::int32_t>(0x6062, 0, kRo, 0, kMap);
  position_actual = d.add<std::int32_t>(object::kPositionActual, 0, kRo, 0, kMap);
  following_error_window =
      d.add<std::uint32_t>(0x6065, 0, kRw, to_wire<std::uint32_t>(p.following_error_window, kMicro));
  following_error_time = d.add<std::uint16_t>(0x6066, 0, kRw, p.following_error_ms);
  velocity_actual = d.add<std::int32_t>(object::kVelocityActual, 0, kRo, 0, kMap);
  target_torque = d.add<std::int16_t>(object::kTargetTorque, 0, kRw, 0, kMap);
  const auto peak = to_wire<std::uint16_t>(p.peak_torque / p.rated_torque, kMilli);
  max_torque = d.add<std::uint16_t>(object::kMaxTorque, 0, kRw, peak, kMap);
  torque_demand = d.add<std::int16_t>(0x6074, 0, kRo, 0, kMap);
  d.add<std::uint32_t>(object::kRatedTorque, 0, kRo, to_wire<std::uint32_t>(p.rated_torque, kMilli));
  torque_actual = d.add<std::int16_t>(object::kTorqueActual, 0, kRo, 0, kMap);
  supply_voltage = d.add<std::uint32_t>(0x6079, 0, kRo, 0, kMap);

  target_position = d.add<std::int32_t>(object::kTargetPosition, 0, kRw, 0, kMap);
  add_count(d, 0x607D, 2);
  lower_limit = d.add<std::int32_t>(0x607D, 1, kRw, to_wire<std::int32_t>(p.lower, kMicro));
  upper_limit = d.add<std::int32_t>(0x607D, 2, kRw, to_wire<std::int32_t>(p.upper, kMicro));
  lower_limit.on_write([this](std::int32_t value) -> Verdict {
    if (value > upper_limit.get()) return SdoAbort::kMaxBelowMin;
    return std::nullopt;
  });
  upper_limit.on_write([this](std::int32_t value) -> Verdict {
    if (value < lower_limit.get()) return SdoAbort::kMaxBelowMin;
    return std::nullopt;
  });
  const auto fastest = to_wire<std::uint32_t>(p.max_velocity, kMicro);
  max_velocity = d.add<std::uint32_t>(0x607F, 0, kRw, fastest).limits(1, fastest);
  deceleration = d.add<std::uint32_t>(0x6084, 0, kRw, to_wire<std::uint32_t>(kDefaultDeceleration, kMicro));
  deceleration.limits(1, UINT32_MAX);
  quick_stop_deceleration =
      d.add<std::uint32_t>(0x6085, 0, kRw, to_wire<std::uint32_t>(kDefaultQuickStopDeceleration, kMicro));
  quick_stop_deceleration.limits(1, UINT32_MAX);

  torque_offset = d.add<std::int16_t>(0x60B2, 0, kRw, 0, kMap);
  add_count(d, object::kInterpolationPeriod, 2);
  interpolation_value =
      d.add<std::uint8_t>(object::kInterpolationPeriod, 1, kRw, p.interpolation_ms).limits(1, 255);
  interpolation_exponent = d.add<std::int8_t>(object::kInterpolationPeriod, 2, kRw, -3).limits(-9, 0);
  add_count(d, object::kAdditionalPosition, 1);
  link_position = d.add<std::int32_t>(object::kAdditionalPosition, 1, kRo, 0, kMap);
  following_error = d.add<std::int32_t>(0x60F4, 0, kRo, 0, kMap);
  target_velocity = d.add<std::int32_t>(object::kTargetVelocity, 0, kRw, 0, kMap);
}

CanopenSlave::PdoSet drive_rpdos(const DriveParameters& p) {
  const std::uint8_t n = p.sync_divider;
  return {{
      {true,
       255,
       0,
       {mapped(object::kControlword, 0, 16), mapped(object::kMode, 0, 8),
        mapped(object::kTargetTorque, 0, 16)}},
      {true, n, 0, {mapped(object::kTargetPosition, 0, 32), mapped(object::kTargetVelocity, 0, 32)}},
      {false,
       n,
       0,
       {mapped(0x60B2, 0, 16), mapped(0x2011, 1, 16), mapped(0x2011, 2, 16),
        mapped(object::kMaxTorque, 0, 16)}},
      {false,
       n,
       0,
       {mapped(object::kControlword, 0, 16), mapped(object::kTargetPosition, 0, 32), mapped(0x60B2, 0, 16)}},
  }};
}

CanopenSlave::PdoSet drive_tpdos(const DriveParameters& p) {
  const std::uint8_t n = p.sync_divider;
  return {{
      {true,
       n,
       0,
       {mapped(object::kStatusword, 0, 16), mapped(object::kModeDisplay, 0, 8),
        mapped(object::kTorqueActual, 0, 16)}},
      {true, n, 0, {mapped(object::kPositionActual, 0, 32), mapped(object::kVelocityActual, 0, 32)}},
      {false, n, 0, {mapped(object::kAdditionalPosition, 1, 32), mapped(object::kSeriesElastic, 2, 32)}},
      {true,
       255,
       100,
       {mapped(object::kErrorCode, 0, 16), mapped(object::kTemperatureCompact, 1, 8),
        mapped(object::kCycleCounter, 1, 16)}},
  }};
}

}  // namespace walkman::nodes
