#include "drivers/cia402/joint_drive.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "drivers/canopen/cob_id.h"
#include "drivers/canopen/little_endian.h"
#include "drivers/canopen/objects.h"
#include "drivers/cia402/power_up.h"

namespace walkman::cia402 {
namespace {

namespace object = canopen::object;
using canopen::get;
using canopen::put;
using canopen::SdoStep;

constexpr double kUnitsPerRad = 1e6;
constexpr double kPermille = 1e-3;
constexpr double kMilli = 1e-3;

// Between two samples the motor may move this many times what its velocity limit allows, plus the slack,
// before the encoder is doubted: contacts and the spring make real motions faster than commanded ones.
constexpr double kImplausibleFactor = 4;
constexpr double kImplausibleSlack = 0.02;  // rad

// 6007h: reaction of the drive to the loss of its master.
constexpr std::uint32_t kQuickStopOnLoss = 3;

std::int32_t to_micro(double value) {
  const double scaled = std::nearbyint(value * kUnitsPerRad);
  constexpr double kMax = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(std::clamp(scaled, -kMax, kMax));
}

/// 60C2h: `period` = value · 10^exponent seconds, value at most 255.
struct InterpolationPeriod {
  std::uint8_t value;
  std::int8_t exponent;
};

InterpolationPeriod interpolation_period(Time period) {
  Time unit = std::chrono::milliseconds(1);
  for (int exponent = -3; exponent >= -9; --exponent, unit /= 10) {
    if (period % unit == Time{0} && period / unit >= 1 && period / unit <= 255) {
      return {static_cast<std::uint8_t>(period / unit), static_cast<std::int8_t>(exponent)};
    }
  }
  throw std::runtime_error("cycle of " + std::to_string(period.count()) +
                           " ns cannot be written to 60C2h, expected 1 to 255 times a power of ten");
}

}  // namespace

std::vector<SdoStep> JointDrive::configuration_of(const DriveSettings& settings, JointDrive& drive) {
  using Kind = SdoStep::Kind;
  const auto [period, exponent] = interpolation_period(settings.node.cycle * settings.sync_divider);
  const std::uint32_t consumer = static_cast<std::uint32_t>(canopen::kMasterNodeId) << 16 |
                                 canopen::milliseconds_of(settings.node.heartbeat_timeout);
  std::vector<SdoStep> steps = canopen::identity_steps(kServoDriveType);
  steps.push_back(
      {Kind::kExpect, {object::kRatedTorque, 0}, 4, settings.rated_torque_mnm, "rated torque, mN·m"});
  steps.push_back({Kind::kNonZero,
                   {object::kSeriesElastic, 3},
                   4,
                   0,
                   "spring constant, mN·m/rad",
                   &drive.spring_constant_mnm_});
  steps.push_back({Kind::kWrite, {object::kInterpolationPeriod, 1}, 1, period, "interpolation period"});
  steps.push_back({Kind::kWrite,
                   {object::kInterpolationPeriod, 2},
                   1,
                   static_cast<std::uint8_t>(exponent),
                   "interpolation period, exponent"});
  steps.push_back(canopen::heartbeat_producer_step(settings.node));
  steps.push_back({Kind::kWrite, {object::kConsumerHeartbeat, 1}, 4, consumer, "consumer heartbeat time"});
  steps.push_back(
      {Kind::kWrite, {object::kAbortConnection, 0}, 2, kQuickStopOnLoss, "abort connection option"});
  steps.push_back(
      {Kind::kWrite, {object::kMaxTorque, 0}, 2, settings.max_torque_permille, "max torque, per mille"});
  return steps;
}

JointDrive::JointDrive(const DriveSettings& settings)
    : RemoteNode(settings.node, configuration_of(settings, *this)),
      sync_divider_(settings.sync_divider),
      max_velocity_(settings.max_velocity),
      configured_max_torque_(settings.max_torque_permille),
      wanted_max_torque_(settings.max_torque_permille),
      written_max_torque_(settings.max_torque_permille),
      rated_torque_mnm_(settings.rated_torque_mnm) {}

void JointDrive::on_begin_boot() noexcept {
  controlword_ = controlword::kDisableVoltage;
  holding_ = false;
  writing_max_torque_ = false;
  wanted_max_torque_ = written_max_torque_ = configured_max_torque_;
  sample_ = DriveSample{};
  counter_seen_ = false;
}

bool JointDrive::has_samples() const noexcept {
  return sample_.tpdo1_at != Time::min() && sample_.tpdo2_at != Time::min();
}

void JointDrive::power_up() noexcept {
  if (!has_samples()) return;
  controlword_ = next_controlword(state(), controlword_);
  if (holding_) return;
  target_urad_ = to_micro(sample_.motor_position);
  target_velocity_urad_ = 0;
  holding_ = controlword_ == controlword::kEnableOperation;
}

bool JointDrive::powered_up() const noexcept {
  return has_samples() && state() == State::kOperationEnabled &&
         sample_.mode == static_cast<std::int8_t>(Mode::kCyclicSynchronousPosition);
}

void JointDrive::set_target(double motor_position, double velocity) noexcept {
  if (!std::isfinite(motor_position) || !std::isfinite(velocity)) return;
  target_urad_ = to_micro(motor_position);
  target_velocity_urad_ = to_micro(velocity);
}

double JointDrive::target() const noexcept { return target_urad_ / kUnitsPerRad; }

can::Frame JointDrive::rpdo1() const noexcept {
  can::Frame frame(canopen::cob_id::rpdo(1, node_id()), {0, 0, 0, 0, 0});
  put(frame.data.data(), controlword_);
  put(frame.data.data() + 2, static_cast<std::int8_t>(Mode::kCyclicSynchronousPosition));
  return frame;
}

can::Frame JointDrive::rpdo2() const noexcept {
  can::Frame frame(canopen::cob_id::rpdo(2, node_id()), {0, 0, 0, 0, 0, 0, 0, 0});
  put(frame.data.data(), target_urad_);
  put(frame.data.data() + 4, target_velocity_urad_);
  return frame;
}

void JointDrive::poll(Time now) noexcept {
  RemoteNode::poll(now);
  if (stage() != Stage::kStarted) return;
  if (writing_max_torque_ && sdo().state() != canopen::SdoClient::State::kBusy) {
    writing_max_torque_ = false;
    if (sdo().state() == canopen::SdoClient::State::kFailed) latch_request_failure();
  }
  // A refused value is latched as a failed request and not asked for again.
  if (!writing_max_torque_ && sdo().pending() == nullptr && wanted_max_torque_ != written_max_torque_) {
    std::array<std::uint8_t, 2> bytes{};
    put(bytes.data(), wanted_max_torque_);
    sdo().download({object::kMaxTorque, 0}, bytes, now);
    written_max_torque_ = wanted_max_torque_;
    writing_max_torque_ = true;
  }
}

void JointDrive::clear_events() noexcept {
  RemoteNode::clear_events();
  implausible_step_ = 0;
  counter_stuck_for_ = Time{0};
}

bool JointDrive::on_tpdo(int number, const can::StampedFrame& stamped) noexcept {
  const can::Frame& frame = stamped.frame;
  const std::uint8_t* bytes = frame.data.data();
  if (number == 1 && frame.length == 5) {
    const auto permille = get<std::int16_t>(bytes + 3);
    sample_.statusword = get<std::uint16_t>(bytes);
    sample_.mode = get<std::int8_t>(bytes + 2);
    sample_.torque = permille * kPermille * rated_torque();
    sample_.torque_out_of_range = permille == std::numeric_limits<std::int16_t>::min() ||
                                  permille == std::numeric_limits<std::int16_t>::max();
    sample_.tpdo1_at = stamped.time;
    return true;
  }
  if (number == 2 && frame.length == 8) {
    on_position(stamped);
    return true;
  }
  if (number == 4 && frame.length == 5) {
    sample_.error_code = get<std::uint16_t>(bytes);
    sample_.motor_temperature_c = get<std::int8_t>(bytes + 2);
    on_counter(get<std::uint16_t>(bytes + 3), stamped.time);
    return true;
  }
  return false;
}

void JointDrive::on_position(const can::StampedFrame& stamped) noexcept {
  const double position = get<std::int32_t>(stamped.frame.data.data()) / kUnitsPerRad;
  if (sample_.tpdo2_at != Time::min()) {
    const Time elapsed = std::max(settings().cycle, stamped.time - sample_.tpdo2_at);
    const double allowed =
        kImplausibleFactor * max_velocity_ * std::chrono::duration<double>(elapsed).count() +
        kImplausibleSlack;
    const double step = position - sample_.motor_position;
    if (implausible_step_ == 0 && std::abs(step) > allowed) implausible_step_ = step;
  }
  sample_.motor_position = position;
  sample_.motor_velocity = get<std::int32_t>(stamped.frame.data.data() + 4) / kUnitsPerRad;
  sample_.tpdo2_at = stamped.time;
}

void JointDrive::on_counter(std::uint16_t counter, Time at) noexcept {
  if (!counter_seen_ || counter != cycle_counter_) {
    counter_seen_ = true;
    cycle_counter_ = counter;
    counter_changed_at_ = at;
    counter_stuck_for_ = Time{0};
  } else {
    counter_stuck_for_ = std::max(Time{0}, at - counter_changed_at_);
  }
}

double JointDrive::spring_constant() const noexcept { return spring_constant_mnm_ * kMilli; }

double JointDrive::rated_torque() const noexcept { return rated_torque_mnm_ * kMilli; }

double JointDrive::link_position() const noexcept {
  return sample_.motor_position - (spring_constant_mnm_ > 0 ? sample_.torque / spring_constant() : 0.0);
}

double JointDrive::motor_position_for(double link_position, double torque) const noexcept {
  return link_position + (spring_constant_mnm_ > 0 ? torque / spring_constant() : 0.0);
}

}  // namespace walkman::cia402
