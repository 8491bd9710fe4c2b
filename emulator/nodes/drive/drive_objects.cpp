#include "emulator/nodes/drive/drive_objects.h"

#include <cmath>

#include "drivers/canopen/objects.h"
#include "emulator/nodes/drive/wire_units.h"

namespace walkman::nodes {

namespace object = canopen::object;

namespace {

constexpr auto kRo = Access::kReadOnly;

constexpr std::uint32_t kBuild = 0x00010000;       // 2000h:1, as the revision number 1018h:3
constexpr std::int16_t kTemperatureWarning = 800;  // 0.1 degC
constexpr std::int16_t kTemperatureTrip = 1000;

// Gains may be raised to these multiples of the factory's: the loops, sampled at 4 kHz with velocities
// filtered over 2 ms, stay stable.
constexpr double kMostP = 4;
constexpr double kMostD = 3;
constexpr double kMostIntegral = 50;         // 1/s, of the factory's P
constexpr std::int64_t kMostTorqueP = 4000;  // per mille
constexpr std::int64_t kMostTorqueI = 100'000;

}  // namespace

DriveObjects::DriveObjects(ObjectDictionary& dictionary, const DriveParameters& parameters,
                           const ServoGains& factory)
    : dictionary_(dictionary) {
  add_identity(parameters);
  add_impedance(parameters);
  add_sensors(parameters);
  add_gains(parameters, factory);
  add_state_objects();
  add_position_objects(parameters);
  add_position_limits(parameters);
  add_profile_objects(parameters);
  add_cyclic_objects(parameters);
  add_homing_objects();
  add_scale_objects(parameters);
  add_velocity_objects();
  add_torque_objects(parameters);
}

void DriveObjects::add_count(std::uint16_t index, std::uint8_t highest_sub) {
  dictionary_.add<std::uint8_t>(index, 0, Access::kConst, highest_sub);
}

void DriveObjects::on_setting(const std::function<void()>& hook) {
  for (Entry* entry : settings_) {
    entry->write_hook = [check = std::move(entry->write_hook), hook](std::uint32_t raw) -> Verdict {
      if (check) {
        if (const Verdict refused = check(raw)) return refused;
      }
      hook();
      return std::nullopt;
    };
  }
}

void DriveObjects::on_measurement_read(const std::function<void()>& hook) {
  for (Entry* entry : measurements_) {
    entry->read_hook = [hook]() -> Verdict {
      hook();
      return std::nullopt;
    };
  }
}

void DriveObjects::add_identity(const DriveParameters& p) {
  add_count(0x2000, 4);
  dictionary_.add<std::uint32_t>(0x2000, 1, kRo, kBuild);
  dictionary_.add<std::uint32_t>(0x2000, 2, kRo, p.model_hash);
  dictionary_.add<std::uint16_t>(0x2000, 3, kRo, p.joint_number);
  dictionary_.add<std::uint16_t>(0x2000, 4, kRo, p.bus_number);
}

void DriveObjects::add_impedance(const DriveParameters& p) {
  // Factory impedance: a fifth of the spring's stiffness, damping ratio 0.7 of the reflected motor on it.
  const double default_stiffness = 0.2 * p.spring_constant;
  const double default_damping = 1.4 * std::sqrt(p.motor_inertia * default_stiffness);
  const auto k = to_wire<std::uint32_t>(default_stiffness, kMilli);
  const auto damp = to_wire<std::uint32_t>(default_damping, kMilli);
  add_count(object::kImpedance, 4);
  stiffness = setting(object::kImpedance, 1, k);
  damping = setting(object::kImpedance, 2, damp);
  stiffness_actual = dictionary_.add<std::uint32_t>(object::kImpedance, 3, kRo, k);
  damping_actual = dictionary_.add<std::uint32_t>(object::kImpedance, 4, kRo, damp);
  add_count(0x2011, 2);
  stiffness_pdo = setting(0x2011, 1, to_wire<std::uint16_t>(default_stiffness, 0.1), Mappable::kYes);
  damping_pdo = setting(0x2011, 2, to_wire<std::uint16_t>(default_damping, 0.01), Mappable::kYes);
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
}

void DriveObjects::add_sensors(const DriveParameters& p) {
  add_count(object::kSeriesElastic, 3);
  deflection = measurement<std::int32_t>(object::kSeriesElastic, 1);
  spring_torque = measurement<std::int32_t>(object::kSeriesElastic, 2);
  dictionary_.add<std::uint32_t>(object::kSeriesElastic, 3, kRo,
                                 to_wire<std::uint32_t>(p.spring_constant, kMilli));
  add_count(object::kTemperature, 4);
  motor_temperature = measurement<std::int16_t>(object::kTemperature, 1);
  board_temperature = measurement<std::int16_t>(object::kTemperature, 2);
  temperature_warning = setting(object::kTemperature, 3, kTemperatureWarning);
  temperature_trip = setting(object::kTemperature, 4, kTemperatureTrip);
  add_count(object::kTemperatureCompact, 1);
  temperature_compact = measurement<std::int8_t>(object::kTemperatureCompact, 1);
  add_count(0x2032, 2);
  lowest_supply = setting(0x2032, 1, to_wire<std::uint32_t>(p.lowest_supply, kMilli));
  highest_supply = setting(0x2032, 2, to_wire<std::uint32_t>(p.highest_supply, kMilli));
  add_count(object::kCycleCounter, 1);
  cycle_counter = dictionary_.add<std::uint16_t>(object::kCycleCounter, 1, kRo, 0, Mappable::kYes);
}

void DriveObjects::add_gains(const DriveParameters& p, const ServoGains& factory) {
  const auto add = [this](std::uint16_t index, const LoopGains& gains, std::array<std::int64_t, 3> most) {
    add_count(index, 3);
    std::array<Object<std::uint32_t>, 3> objects;
    const std::array<double, 3> values{gains.p, gains.i, gains.d};
    for (std::size_t i = 0; i < 3; ++i) {
      objects[i] =
          setting(index, static_cast<std::uint8_t>(i + 1), to_wire<std::uint32_t>(values[i], kMilli));
      objects[i].limits(0, most[i]);
    }
    return objects;
  };
  const auto milli = [](double value) -> std::int64_t { return to_wire<std::uint32_t>(value, kMilli); };
  position_gains = add(0x2040, factory.position,
                       {milli(kMostP * factory.position.p), milli(kMostIntegral * factory.position.p),
                        milli(kMostD * factory.position.d)});
  velocity_gains = add(
      0x2041, factory.velocity,
      {milli(kMostD * factory.velocity.p), milli(kMostP * factory.velocity.i), milli(0.5 * p.motor_inertia)});
  torque_gains = add(0x2042, factory.torque, {kMostTorqueP, kMostTorqueI, milli(kMostD * factory.torque.d)});
}

}  // namespace walkman::nodes
