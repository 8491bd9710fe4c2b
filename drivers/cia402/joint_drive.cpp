#include "drivers/cia402/joint_drive.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include "drivers/canopen/little_endian.h"
#include "drivers/canopen/objects.h"

namespace walkman::cia402 {
namespace {

namespace object = canopen::object;
using canopen::get;
using canopen::put;
using canopen::SdoStep;

constexpr double kUnitsPerRad = 1e6;
constexpr double kPermille = 1e-3;
constexpr double kMilli = 1e-3;

// Between two samples the motor may move this multiple of what its velocity limit allows, plus the slack,
// before the encoder is doubted: contacts and the spring make real motions faster than commanded ones.
constexpr double kImplausibleFactor = 4;
constexpr double kImplausibleSlack = 0.02;  // rad

// The counter advances with every SYNC: if it is unchanged this many cycles later, it is not running. The
// TPDO of layout A that carries it comes with every 20th.
constexpr int kStuckCycles = 15;

constexpr auto kPositionMode = static_cast<std::uint32_t>(Mode::kCyclicSynchronousPosition);

// A motor may be this far outside its joint's limits: deflected spring, soft stop, calibration.
constexpr double kReachMargin = 0.5;  // rad

// Statusword bit 7.
constexpr std::uint16_t kWarningBit = 0x0080;

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

/// The controlword that brings a drive in `state` one transition closer to operation enabled (CiA 402-2,
/// state machine). In the fault state it alternates with `last`, because fault reset acts only on bit 7's
/// rising edge.
std::uint16_t next_controlword(State state, std::uint16_t last) noexcept {
  switch (state) {
    case State::kSwitchOnDisabled:
      return controlword::kShutdown;
    case State::kReadyToSwitchOn:
      return controlword::kSwitchOn;
    case State::kSwitchedOn:
    case State::kOperationEnabled:
      return controlword::kEnableOperation;
    case State::kFault:
      return (last & controlword::kFaultReset) != 0 ? controlword::kDisableVoltage : controlword::kFaultReset;
    case State::kNotReadyToSwitchOn:
    case State::kQuickStopActive:
    case State::kFaultReactionActive:
      return controlword::kDisableVoltage;
  }
  return controlword::kDisableVoltage;
}

}  // namespace

std::vector<SdoStep> JointDrive::configuration_of(const DriveSettings& settings) {
  using Kind = SdoStep::Kind;
  const auto [period, exponent] = interpolation_period(settings.node.cycle * mapping_.sync_divider());
  std::vector<SdoStep> steps = canopen::identity_steps(settings.node, kServoDriveType, vendor_place());
  const auto append = [&steps](const std::vector<SdoStep>& more) { canopen::append(steps, more); };
  append({{Kind::kExpect, {object::kRatedTorque, 0}, 4, settings.rated_torque_mnm, "rated torque, mN·m"},
          {Kind::kNonZero,
           {object::kSeriesElastic, 3},
           4,
           0,
           "spring constant, mN·m/rad",
           &spring_constant_mnm_},
          {Kind::kWrite, {object::kInterpolationPeriod, 1}, 1, period, "interpolation period"},
          {Kind::kWrite,
           {object::kInterpolationPeriod, 2},
           1,
           static_cast<std::uint8_t>(exponent),
           "interpolation period, exponent"}});
  append(canopen::supervision_steps(settings.node));
  append({{Kind::kWrite, {object::kAbortConnection, 0}, 2, kQuickStopOnLoss, "abort connection option"},
          {Kind::kWrite, {object::kMaxTorque, 0}, 2, settings.max_torque_permille, "max torque, per mille"}});
  // If no PDO carries the mode, it is set and checked here.
  if (!mapping_.has(DriveValue::kMode)) {
    append({{Kind::kWrite, {object::kMode, 0}, 1, kPositionMode, "mode of operation"}});
  }
  if (!mapping_.has(DriveValue::kModeDisplay)) {
    append({{Kind::kExpect, {object::kModeDisplay, 0}, 1, kPositionMode, "mode of operation display"}});
  }
  for (std::size_t i = 0; i < kept_.size(); ++i) {
    const canopen::MappingEntry& kept = mapping_.kept()[i];
    append({{Kind::kRead,
             {kept.index, kept.sub},
             static_cast<std::uint8_t>(kept.bits / 8),
             0,
             "value to be kept",
             &kept_[i]}});
  }
  append(canopen::pdo_steps(settings.node.pdos, settings.node.node_id));
  return steps;
}

JointDrive::JointDrive(const DriveSettings& settings)
    : RemoteNode(settings.node),
      mapping_(settings.node.pdos),
      kept_(mapping_.kept().size()),
      limits_(settings.limits),
      configured_max_torque_(settings.max_torque_permille),
      wanted_max_torque_(settings.max_torque_permille),
      written_max_torque_(settings.max_torque_permille),
      rated_torque_mnm_(settings.rated_torque_mnm) {
  set_configuration(configuration_of(settings));
}

void JointDrive::on_begin_boot() noexcept {
  controlword_ = controlword::kDisableVoltage;
  holding_ = false;
  writing_max_torque_ = false;
  wanted_max_torque_ = written_max_torque_ = configured_max_torque_;
  sample_ = DriveSample{};
  if (!mapping_.has(DriveValue::kModeDisplay)) sample_.mode = static_cast<std::int8_t>(kPositionMode);
  position_at_ = Time::min();
  counter_seen_ = false;
}

void JointDrive::begin_power_up() noexcept {
  if (in_operation()) return;
  controlword_ = controlword::kDisableVoltage;
  holding_ = false;
}

void JointDrive::power_up() noexcept {
  if (!has_cyclic_data()) return;
  controlword_ = next_controlword(state(), controlword_);
  if (holding_) return;
  target_urad_ = to_micro(sample_.motor_position);
  target_velocity_urad_ = 0;
  holding_ = controlword_ == controlword::kEnableOperation;
}

void JointDrive::end_power_up() noexcept { goal_ = set_point_ = target_urad_ / kUnitsPerRad; }

bool JointDrive::in_operation() const noexcept {
  // Without 6061h in a TPDO the mode was checked by the configuration.
  return holding_ && has_cyclic_data() && state() == State::kOperationEnabled &&
         (!mapping_.has(DriveValue::kModeDisplay) || sample_.mode == static_cast<std::int8_t>(kPositionMode));
}

double JointDrive::command(double link_position, double torque) noexcept {
  const double position = std::clamp(link_position, limits_.lower, limits_.upper);
  of_joint_ = true;
  goal_ = position + deflection(std::clamp(torque, -limits_.effort, limits_.effort));
  return position;
}

void JointDrive::command_travel(double share) noexcept {
  goal_ = limits_.lower + std::clamp(share, 0.0, 1.0) * (limits_.upper - limits_.lower);
}

void JointDrive::hold() noexcept {
  goal_ = set_point_;
  set_target(set_point_, 0);
}

void JointDrive::advance() noexcept {
  const double period = std::chrono::duration<double>(settings().cycle).count() * sync_divider();
  const double longest = limits_.velocity * period;
  const double step = std::clamp(goal_ - set_point_, -longest, longest);
  set_point_ += step;
  set_target(set_point_, step / period);
}

void JointDrive::set_target(double motor_position, double velocity) noexcept {
  if (!std::isfinite(motor_position) || !std::isfinite(velocity)) return;
  target_urad_ = to_micro(motor_position);
  target_velocity_urad_ = to_micro(velocity);
}

std::uint32_t JointDrive::word_of(const DriveField& field) const noexcept {
  switch (field.value) {
    case DriveValue::kControlword:
      return controlword_;
    case DriveValue::kMode:
      return kPositionMode;
    case DriveValue::kTargetPosition:
      return static_cast<std::uint32_t>(target_urad_);
    case DriveValue::kTargetVelocity:
      return static_cast<std::uint32_t>(target_velocity_urad_);
    case DriveValue::kMaxTorque:
      return wanted_max_torque_;
    case DriveValue::kKept:
      return kept_[field.kept];
    default:
      // Target torque and torque offset: in position mode the drive's own loop determines the torque.
      return 0;
  }
}

bool JointDrive::rpdo(int number, can::Frame& out) const noexcept {
  const canopen::PdoSettings& pdo = settings().pdos.receive[static_cast<std::size_t>(number - 1)];
  if (!pdo.enabled) return false;
  const std::size_t bytes = pdo.bytes();
  out = can::Frame{};
  out.id = pdo.cob_id_base + node_id();
  out.fd = bytes > 8;
  out.length = can::fd_length(bytes);
  for (const DriveField& field : mapping_.receive(number)) {
    const std::uint32_t value = word_of(field);
    std::memcpy(out.data.data() + field.offset, &value, std::min<std::size_t>(field.bytes, sizeof value));
  }
  return true;
}

bool JointDrive::carries_stop(int number) const noexcept {
  for (const DriveField& field : mapping_.receive(number)) {
    if (field.value == DriveValue::kControlword) return true;
  }
  return false;
}

void JointDrive::poll(Time now) noexcept {
  RemoteNode::poll(now);
  sample_.age = canopen::age_of(cyclic_data_at(), now);
  check_motion();
  if (stage() != Stage::kStarted) return;
  if (writing_max_torque_ && sdo().state() != canopen::SdoClient::State::kBusy) {
    writing_max_torque_ = false;
    if (sdo().state() == canopen::SdoClient::State::kFailed) latch_request_failure();
  }
  if (mapping_.has(DriveValue::kMaxTorque)) return;
  // A refused value is latched as a failed request and not requested again.
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
  check_.restart();
  counter_stuck_for_ = Time{0};
}

void JointDrive::on_tpdo(int number, const can::StampedFrame& stamped) noexcept {
  for (const DriveField& field : mapping_.transmit(number)) {
    const std::uint8_t* bytes = stamped.frame.data.data() + field.offset;
    switch (field.value) {
      case DriveValue::kStatusword:
        sample_.statusword = get<std::uint16_t>(bytes);
        break;
      case DriveValue::kModeDisplay:
        sample_.mode = get<std::int8_t>(bytes);
        break;
      case DriveValue::kTorque: {
        const auto permille = get<std::int16_t>(bytes);
        sample_.torque = permille * kPermille * (rated_torque_mnm_ * kMilli);
        sample_.torque_out_of_range = permille == std::numeric_limits<std::int16_t>::min() ||
                                      permille == std::numeric_limits<std::int16_t>::max();
        break;
      }
      case DriveValue::kPosition:
        on_position(get<std::int32_t>(bytes) / kUnitsPerRad, stamped.time);
        break;
      case DriveValue::kVelocity:
        sample_.motor_velocity = get<std::int32_t>(bytes) / kUnitsPerRad;
        break;
      case DriveValue::kErrorCode:
        sample_.error_code = get<std::uint16_t>(bytes);
        break;
      case DriveValue::kTemperature:
        sample_.motor_temperature_c = get<std::int8_t>(bytes);
        break;
      case DriveValue::kCycleCounter:
        on_counter(get<std::uint16_t>(bytes), stamped.time);
        break;
      default:
        break;
    }
  }
  sample_.link_position = sample_.motor_position - deflection(sample_.torque);
}

void JointDrive::on_position(double position, Time at) noexcept {
  if (position_at_ != Time::min()) {
    const Time period = settings().cycle * sync_divider();
    const Time elapsed = std::max(settings().cycle, at - position_at_);
    const double allowed =
        kImplausibleFactor * limits_.velocity * std::chrono::duration<double>(elapsed).count() +
        kImplausibleSlack;
    const double step = position - sample_.motor_position;
    if (implausible_step_ == 0 && std::abs(step) > allowed) implausible_step_ = step;
    // Positions are sampled at SYNC, so they are whole periods apart no matter when their frames arrive. Two
    // PDOs of one SYNC may both carry the position.
    const auto periods = (at - position_at_ + period / 2) / period;
    if (!mapping_.has(DriveValue::kVelocity) && periods >= 1) {
      const double seconds = std::chrono::duration<double>(period).count() * static_cast<double>(periods);
      sample_.motor_velocity = step / seconds;
    }
  }
  sample_.motor_position = position;
  position_at_ = at;
}

void JointDrive::check_motion() noexcept {
  const Time at = cyclic_data_at();
  if (!of_joint_ || !in_operation()) {
    check_.restart();
    checked_at_ = at;
    return;
  }
  if (at == checked_at_) return;
  const Time period = settings().cycle * sync_divider();
  check_.take(
      sample_.motor_position, sample_.torque, set_point_, (at - checked_at_ + period / 2) / period, period,
      {limits_.velocity, spring_constant(), limits_.effort, kPermille * (rated_torque_mnm_ * kMilli)});
  checked_at_ = at;
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

double JointDrive::deflection(double torque) const noexcept {
  return spring_constant_mnm_ > 0 ? torque / spring_constant() : 0.0;
}

std::optional<canopen::FaultCause> JointDrive::judge_state() const noexcept {
  if (!has_cyclic_data() || state() == State::kOperationEnabled) return std::nullopt;
  return canopen::cause::DriveState{sample_.statusword, sample_.error_code, name_of(state()),
                                    error_text(sample_.error_code)};
}

std::optional<canopen::FaultCause> JointDrive::judge_values(Time /*now*/) const noexcept {
  namespace cause = canopen::cause;
  if (counter_stuck_for_ > kStuckCycles * settings().cycle) {
    return cause::CounterStuck{cycle_counter_, counter_stuck_for_};
  }
  if (implausible_step_ != 0) return cause::PositionJump{implausible_step_};
  if (const auto found = check_.cause()) return found;
  const bool below = sample_.motor_position < limits_.lower - kReachMargin;
  if (below || sample_.motor_position > limits_.upper + kReachMargin) {
    return cause::BeyondReach{sample_.motor_position, below ? limits_.lower : limits_.upper};
  }
  if (sample_.torque_out_of_range) return cause::OutOfRange{};
  return std::nullopt;
}

std::string JointDrive::what_samples_miss() const {
  if (state() != State::kOperationEnabled) {
    return fmt::format("stays in state {} (statusword {:04X}h, error code {:04X}h), not operation enabled",
                       name_of(state()), sample_.statusword, sample_.error_code);
  }
  if (!in_operation()) return fmt::format("mode of operation (6061h) is {}, not 8", sample_.mode);
  return {};
}

std::string JointDrive::warning() const {
  if (!has_cyclic_data() || (sample_.statusword & kWarningBit) == 0) return {};
  return fmt::format("reports a warning (statusword {:04X}h, motor at {} degC)", sample_.statusword,
                     sample_.motor_temperature_c);
}

std::string_view JointDrive::error_text(std::uint16_t code) const noexcept {
  // CiA 402-2, error codes of the drive profile.
  switch (code) {
    case 0x2220:
      return "continuous over-current inside the device";
    case 0x2310:
      return "continuous over-current at the output";
    case 0x2320:
      return "short circuit or earth leakage at the output";
    case 0x2350:
      return "thermal overload (i2t)";
    case 0x3210:
      return "DC link over-voltage";
    case 0x3220:
      return "DC link under-voltage";
    case 0x4210:
      return "drive over-temperature";
    case 0x4310:
      return "motor over-temperature";
    case 0x5112:
      return "logic supply low";
    case 0x5530:
      return "non-volatile memory";
    case 0x6010:
      return "software reset (watchdog)";
    case 0x6320:
      return "parameter error";
    case 0x7121:
      return "motor blocked";
    case 0x7122:
      return "motor error or commutation";
    case 0x7305:
      return "motor-side encoder failure";
    case 0x7306:
      return "link-side encoder failure";
    case 0x8311:
      return "torque limit exceeded";
    case 0x8611:
      return "following error";
    case 0x8612:
      return "position reference limit";
    default:
      return canopen::communication_error_text(code);
  }
}

}  // namespace walkman::cia402
