#include "emulator/nodes/drive/servo_settings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "emulator/nodes/cia301/object_table.h"

namespace walkman::nodes {
namespace {

/// Converts a window in urad; FFFFFFFFh switches it off.
double window(std::uint32_t value) noexcept {
  return value == UINT32_MAX ? std::numeric_limits<double>::infinity() : value * kMicro;
}

/// Converts a gain; the factory gain is not rounded to the object's unit.
double gain(const Object<std::uint32_t>& object, double unit, double factory) noexcept {
  return object.get() == to_wire<std::uint32_t>(factory, unit) ? factory : object.get() * unit;
}

LoopGains loop_gains(const std::array<Object<std::uint32_t>, 3>& objects, double unit_p, double unit_i,
                     double unit_d, const LoopGains& factory) noexcept {
  return {gain(objects[0], unit_p, factory.p), gain(objects[1], unit_i, factory.i),
          gain(objects[2], unit_d, factory.d)};
}

}  // namespace

ServoSettings ServoSettings::from(const DriveObjects& o, const DriveParameters& p,
                                  const ServoGains& factory) noexcept {
  ServoSettings s;
  s.max_velocity = std::min(o.max_velocity.get(), o.max_motor_speed.get()) * kMicro;
  s.deceleration = o.deceleration.get() * kMicro;
  s.quick_stop_deceleration = o.quick_stop_deceleration.get() * kMicro;
  s.profile = {std::min(o.profile_velocity.get() * kMicro, s.max_velocity), o.acceleration.get() * kMicro,
               s.deceleration};
  s.interpolation_period = o.interpolation_value.get() * std::pow(10.0, o.interpolation_exponent.get());
  s.following_window = window(o.following_error_window.get());
  s.following_time = o.following_error_time.get() * kMilli;
  s.position_window = window(o.position_window.get());
  s.position_time = o.position_window_time.get() * kMilli;
  s.velocity_window = o.velocity_window.get() * kMicro;
  s.velocity_window_time = o.velocity_window_time.get() * kMilli;
  s.velocity_threshold = o.velocity_threshold.get() * kMicro;
  s.velocity_threshold_time = o.velocity_threshold_time.get() * kMilli;
  s.rated_torque = p.rated_torque;
  s.rated_current = p.rated_current;
  s.peak_torque = p.peak_torque;
  s.per_mille = p.rated_torque * kMilli;
  // Torque is proportional to current, by the ratio of the rated values.
  const double permille = std::min(o.max_torque.get(), o.max_current.get());
  s.torque_limit = std::min(p.peak_torque, permille * kMilli * p.rated_torque);
  s.max_current = o.max_current.get() * kMilli * p.rated_current;
  s.torque_slope = o.torque_slope.get() * s.per_mille;
  s.stiffness = o.stiffness_actual.get() * kMilli;
  s.damping = o.damping_actual.get() * kMilli;
  s.temperature_warning = o.temperature_warning.get() * kDeci;
  s.temperature_trip = o.temperature_trip.get() * kDeci;
  s.lowest_supply = o.lowest_supply.get() * kMilli;
  s.highest_supply = o.highest_supply.get() * kMilli;
  s.gains.position = loop_gains(o.position_gains, kMilli, kMilli, kMilli, factory.position);
  s.gains.velocity = loop_gains(o.velocity_gains, kMilli, kMilli, kMilli, factory.velocity);
  s.gains.torque = loop_gains(o.torque_gains, kMilli, kMilli, kMilli, factory.torque);
  return s;
}

}  // namespace walkman::nodes
