// Position, velocity, torque, homing and scale of a drive: 6062h-60FFh.

#include <algorithm>
#include <numbers>

#include "drivers/canopen/objects.h"
#include "emulator/nodes/cia301/choice.h"
#include "emulator/nodes/drive/drive_objects.h"
#include "emulator/nodes/drive/wire_units.h"

namespace walkman::nodes {

namespace object = canopen::object;

namespace {

constexpr auto kRo = Access::kReadOnly;
constexpr auto kRw = Access::kReadWrite;
constexpr auto kMap = Mappable::kYes;

// CiA 303-2: prefix exponent, numerator, denominator; 10h is rad, 03h is s, and FAh is 10^-6.
constexpr std::uint32_t kMicroRadian = 0xFA100000;
constexpr std::uint32_t kMicroRadianPerSecond = 0xFA100300;
constexpr std::uint32_t kTurn = 6'283'185;  // urad

constexpr std::uint32_t kDefaultVelocity = 1'000'000;                // urad/s
constexpr std::uint32_t kDefaultAcceleration = 10'000'000;           // urad/s^2
constexpr std::uint32_t kDefaultQuickStopDeceleration = 40'000'000;  // urad/s^2
constexpr std::uint32_t kDefaultTorqueSlope = 10'000;                // per mille of rated torque a second
constexpr std::uint32_t kDefaultHomingSpeed = 100'000;               // urad/s

}  // namespace

void DriveObjects::add_position_objects(const DriveParameters& p) {
  position_demand = measurement<std::int32_t>(0x6062, 0);
  position_increments = measurement<std::int32_t>(0x6063, 0);
  position_actual = measurement<std::int32_t>(object::kPositionActual, 0);
  following_error_window = setting(0x6065, 0, to_wire<std::uint32_t>(p.following_error_window, kMicro));
  following_error_time = setting(0x6066, 0, p.following_error_ms);
  position_window = setting<std::uint32_t>(0x6067, 0, 2000);
  position_window_time = setting<std::uint16_t>(0x6068, 0, 10);
  target_position = dictionary_.add<std::int32_t>(object::kTargetPosition, 0, kRw, 0, kMap);
  add_count(object::kAdditionalPosition, 1);
  link_position = measurement<std::int32_t>(object::kAdditionalPosition, 1);
  add_count(0x60E5, 1);
  link_velocity = measurement<std::int32_t>(0x60E5, 1);
  following_error = measurement<std::int32_t>(0x60F4, 0);
}

void DriveObjects::add_position_limits(const DriveParameters& p) {
  add_count(0x607D, 2);
  lower_limit = dictionary_.add<std::int32_t>(0x607D, 1, kRw, to_wire<std::int32_t>(p.lower, kMicro));
  upper_limit = dictionary_.add<std::int32_t>(0x607D, 2, kRw, to_wire<std::int32_t>(p.upper, kMicro));
  lower_limit.on_write([this](std::int32_t value) -> Verdict {
    if (value > upper_limit.get()) return SdoAbort::kMaxBelowMin;
    return std::nullopt;
  });
  upper_limit.on_write([this](std::int32_t value) -> Verdict {
    if (value < lower_limit.get()) return SdoAbort::kMaxBelowMin;
    return std::nullopt;
  });
}

void DriveObjects::add_profile_objects(const DriveParameters& p) {
  const auto fastest = to_wire<std::uint32_t>(p.max_velocity, kMicro);
  max_velocity = setting(0x607F, 0, fastest).limits(1, fastest);
  max_motor_speed = setting(0x6080, 0, fastest).limits(1, fastest);
  profile_velocity = setting(0x6081, 0, std::min(fastest, kDefaultVelocity)).limits(1, UINT32_MAX);
  acceleration = setting(0x6083, 0, kDefaultAcceleration).limits(1, UINT32_MAX);
  deceleration = setting(0x6084, 0, kDefaultAcceleration).limits(1, UINT32_MAX);
  quick_stop_deceleration = setting(0x6085, 0, kDefaultQuickStopDeceleration).limits(1, UINT32_MAX);
  auto profile_type = dictionary_.add<std::int16_t>(0x6086, 0, kRw, 0);
  allow<std::int16_t>(profile_type, {0});  // linear ramps
}

void DriveObjects::add_cyclic_objects(const DriveParameters& p) {
  position_offset = dictionary_.add<std::int32_t>(0x60B0, 0, kRw, 0, kMap);
  velocity_offset = dictionary_.add<std::int32_t>(0x60B1, 0, kRw, 0, kMap);
  torque_offset = dictionary_.add<std::int16_t>(0x60B2, 0, kRw, 0, kMap);
  auto sub_mode = dictionary_.add<std::int16_t>(0x60C0, 0, kRw, 0);
  allow<std::int16_t>(sub_mode, {0});  // linear interpolation
  add_count(0x60C1, 1);
  interpolation_target = dictionary_.add<std::int32_t>(0x60C1, 1, kRw, 0, kMap);
  add_count(object::kInterpolationPeriod, 2);
  interpolation_value = setting(object::kInterpolationPeriod, 1, p.interpolation_ms).limits(1, 255);
  interpolation_exponent = setting<std::int8_t>(object::kInterpolationPeriod, 2, -3).limits(-9, 0);
}

void DriveObjects::add_homing_objects() {
  home_offset = dictionary_.add<std::int32_t>(0x607C, 0, kRw, 0);
  homing_method = dictionary_.add<std::int8_t>(0x6098, 0, kRw, 0);
  allow<std::int8_t>(homing_method, {0, 35, 37});
  // Speeds and acceleration are kept for masters that write them: the methods offered move nothing.
  add_count(0x6099, 2);
  for (const std::uint8_t sub : {std::uint8_t{1}, std::uint8_t{2}}) {
    dictionary_.add<std::uint32_t>(0x6099, sub, kRw, kDefaultHomingSpeed).limits(1, UINT32_MAX);
  }
  dictionary_.add<std::uint32_t>(0x609A, 0, kRw, kDefaultAcceleration).limits(1, UINT32_MAX);
  add_count(0x60E3, 2);
  dictionary_.add<std::int8_t>(0x60E3, 1, kRo, 35);
  dictionary_.add<std::int8_t>(0x60E3, 2, kRo, 37);
}

void DriveObjects::add_scale_objects(const DriveParameters& p) {
  // 6064h = 6063h x feed constant / (encoder resolution x gear ratio), all on the joint side of the gearbox.
  const auto add = [this](std::uint16_t index, std::uint32_t numerator) {
    add_count(index, 2);
    dictionary_.add<std::uint32_t>(index, 1, kRo, numerator);
    dictionary_.add<std::uint32_t>(index, 2, kRo, 1);
  };
  add(0x608F, to_wire<std::uint32_t>(2 * std::numbers::pi, p.motor_encoder_step));
  add(0x6091, 1);
  add(0x6092, kTurn);
  dictionary_.add<std::uint32_t>(0x60A8, 0, kRo, kMicroRadian);
  dictionary_.add<std::uint32_t>(0x60A9, 0, kRo, kMicroRadianPerSecond);
}

void DriveObjects::add_velocity_objects() {
  velocity_demand = measurement<std::int32_t>(0x606B, 0);
  velocity_actual = measurement<std::int32_t>(object::kVelocityActual, 0);
  velocity_window = setting<std::uint16_t>(0x606D, 0, 50'000);
  velocity_window_time = setting<std::uint16_t>(0x606E, 0, 10);
  velocity_threshold = setting<std::uint16_t>(0x606F, 0, 20'000);
  velocity_threshold_time = setting<std::uint16_t>(0x6070, 0, 10);
  target_velocity = dictionary_.add<std::int32_t>(object::kTargetVelocity, 0, kRw, 0, kMap);
}

void DriveObjects::add_torque_objects(const DriveParameters& p) {
  target_torque = dictionary_.add<std::int16_t>(object::kTargetTorque, 0, kRw, 0, kMap);
  const auto peak = to_wire<std::uint16_t>(p.peak_torque / p.rated_torque, kMilli);
  max_torque = setting(object::kMaxTorque, 0, peak, kMap);
  max_current = setting(0x6073, 0, peak);
  torque_demand = measurement<std::int16_t>(0x6074, 0);
  dictionary_.add<std::uint32_t>(0x6075, 0, kRo, to_wire<std::uint32_t>(p.rated_current, kMilli));
  dictionary_.add<std::uint32_t>(object::kRatedTorque, 0, kRo,
                                 to_wire<std::uint32_t>(p.rated_torque, kMilli));
  torque_actual = measurement<std::int16_t>(object::kTorqueActual, 0);
  current_actual = measurement<std::int16_t>(0x6078, 0);
  torque_slope = setting(0x6087, 0, kDefaultTorqueSlope).limits(1, UINT32_MAX);
  auto torque_profile = dictionary_.add<std::int16_t>(0x6088, 0, kRw, 0);
  allow<std::int16_t>(torque_profile, {0});  // linear ramp
}

}  // namespace walkman::nodes
