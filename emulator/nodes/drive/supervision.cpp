#include "emulator/nodes/drive/supervision.h"

#include <algorithm>
#include <cmath>

#include "emulator/nodes/cia301/emergency_producer.h"

namespace walkman::nodes {
namespace {

enum Bit : std::uint8_t {
  kMotorHot = 1U << 0U,
  kBoardHot = 1U << 1U,
  kOverVoltage = 1U << 2U,
  kUnderVoltage = 1U << 3U,
  kMotorEncoder = 1U << 4U,
  kLinkEncoder = 1U << 5U,
  kOverCurrent = 1U << 6U,
};

constexpr double kFrozen = 0.01;            // s without any change
constexpr double kOverCurrentShare = 1.1;   // of 6073h
constexpr double kOverCurrentTime = 0.005;  // s
// Contacts and the spring can make real motions faster than the velocity limit.
constexpr double kJumpFactor = 20;

bool finite(double value) noexcept { return std::abs(value) <= 1e9; }

}  // namespace

const std::array<Supervision::Cause, 7> Supervision::kCauses = {{
    {kMotorHot, 0x4310, error_register::kTemperature, false},
    {kBoardHot, 0x4210, error_register::kTemperature, false},
    {kOverVoltage, 0x3210, error_register::kVoltage, false},
    {kUnderVoltage, 0x3220, error_register::kVoltage, false},
    {kMotorEncoder, 0x7305, error_register::kProfile, true},
    {kLinkEncoder, 0x7306, error_register::kProfile, true},
    {kOverCurrent, 0x2310, error_register::kCurrent, true},
}};

const std::uint8_t Supervision::kEncoders = kMotorEncoder | kLinkEncoder;

Supervision::Supervision(const DriveParameters& p)
    : impossible_deflection_(p.impossible_deflection > 0 ? p.impossible_deflection
                                                         : 3 * p.peak_torque / p.spring_constant + 0.05),
      fastest_(kJumpFactor * p.max_velocity) {}

void Supervision::step(const ServoFeedback& f, const ServoSettings& s, bool needs_supply,
                       double dt) noexcept {
  const Housekeeping seen{f.motor_temperature_c, f.board_temperature_c, f.supply_voltage, needs_supply};
  if (!(seen == seen_)) judge(seen, s);
  causes_ = static_cast<std::uint8_t>(slow_causes_ | encoders(f, dt));
  const bool over = std::abs(f.motor_current) > kOverCurrentShare * s.max_current;
  if (!over && over_current_for_ == 0) return;
  over_current_for_ = over ? over_current_for_ + dt : 0;
  if (over_current_for_ > kOverCurrentTime) causes_ |= kOverCurrent;
}

void Supervision::judge(const Housekeeping& seen, const ServoSettings& s) noexcept {
  seen_ = seen;
  warning_ = std::max(seen.motor_c, seen.board_c) >= s.temperature_warning;
  supplied_ = seen.supply >= s.lowest_supply;
  slow_causes_ = 0;
  if (seen.motor_c >= s.temperature_trip) slow_causes_ |= kMotorHot;
  if (seen.board_c >= s.temperature_trip) slow_causes_ |= kBoardHot;
  if (seen.supply > s.highest_supply) slow_causes_ |= kOverVoltage;
  if (seen.needs_supply && !supplied_) slow_causes_ |= kUnderVoltage;
}

std::uint8_t Supervision::encoders(const ServoFeedback& f, double dt) noexcept {
  motor_.step(f.motor_position, fastest_ * dt, dt);
  link_.step(f.link_position, fastest_ * dt, dt);
  std::uint8_t causes = 0;
  // Avoids comparisons that a NaN would pass.
  const bool plausible = std::abs(f.motor_position - f.link_position) <= impossible_deflection_;
  if (plausible && finite(std::abs(f.motor_velocity) + std::abs(f.link_velocity) + f.link_position)) {
    motor_.trust();
    link_.trust();
    return 0;
  }
  if (!finite(f.motor_position) || !finite(f.motor_velocity)) causes |= kMotorEncoder;
  if (!finite(f.link_position) || !finite(f.link_velocity)) causes |= kLinkEncoder;
  if (causes != 0) return causes;
  // The spring cannot deflect so far: the encoder that has jumped or no longer changes is the faulty one.
  const bool motor_wrong = motor_.jumped() || (motor_.frozen(kFrozen) && !link_.jumped());
  return motor_wrong ? kMotorEncoder : kLinkEncoder;
}

void Supervision::reset() noexcept {
  motor_ = link_ = EncoderWatch{};
  settings_changed();
  over_current_for_ = 0;
  causes_ = slow_causes_ = 0;
  warning_ = false;
  supplied_ = true;
}

}  // namespace walkman::nodes
