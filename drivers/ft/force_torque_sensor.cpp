#include "drivers/ft/force_torque_sensor.h"

#include <algorithm>
#include <limits>

#include "drivers/canopen/little_endian.h"
#include "drivers/canopen/objects.h"

namespace walkman::ft {
namespace {

namespace object = canopen::object;
using canopen::get;
using canopen::SdoStep;

constexpr std::uint32_t kTaraSignature = 0x61726174;  // "tara"

double scaled(std::int16_t raw, std::uint32_t digits) {
  double value = raw;
  for (std::uint32_t i = 0; i < digits; ++i) value /= 10;
  return value;
}

bool at_an_end(std::int16_t raw) {
  return raw == std::numeric_limits<std::int16_t>::min() || raw == std::numeric_limits<std::int16_t>::max();
}

}  // namespace

std::vector<SdoStep> ForceTorqueSensor::configuration_of(const canopen::NodeSettings& settings,
                                                         ForceTorqueSensor& sensor) {
  std::vector<SdoStep> steps = canopen::identity_steps(kForceTorqueType);
  steps.push_back(canopen::heartbeat_producer_step(settings));
  for (std::size_t i = 0; i < kChannels; ++i) {
    steps.push_back({SdoStep::Kind::kRead,
                     {object::kDecimalDigits, static_cast<std::uint8_t>(i + 1)},
                     1,
                     0,
                     "decimal digits of the process value",
                     &sensor.digits_[i]});
  }
  return steps;
}

ForceTorqueSensor::ForceTorqueSensor(const canopen::NodeSettings& settings)
    : RemoteNode(settings, configuration_of(settings, *this)) {}

void ForceTorqueSensor::on_begin_boot() noexcept {
  sample_ = ForceTorqueSample{};
  waiting_ = false;
  tpdo1_at_ = tpdo2_at_ = Time::min();
  tare_state_ = TareState::kIdle;
}

bool ForceTorqueSensor::on_tpdo(int number, const can::StampedFrame& stamped) noexcept {
  const std::uint8_t* bytes = stamped.frame.data.data();
  if (number == 1 && stamped.frame.length == 8) {
    if (waiting_) ++unpaired_;
    for (std::size_t i = 0; i < 3; ++i) force_raw_[i] = get<std::int16_t>(bytes + 2 * i);
    waiting_counter_ = get<std::uint16_t>(bytes + 6);
    waiting_ = true;
    tpdo1_at_ = stamped.time;
    return true;
  }
  if (number == 2 && stamped.frame.length == 7) {
    // Frames of one SYNC follow each other within the cycle; those of different ones are a cycle apart.
    const bool same_sync =
        waiting_ && stamped.time >= tpdo1_at_ && stamped.time - tpdo1_at_ < settings().cycle * 3 / 4;
    tpdo2_at_ = stamped.time;
    if (same_sync && (!has_sample() || waiting_counter_ != sample_.counter)) {
      complete(stamped);
    } else {
      ++unpaired_;
    }
    waiting_ = false;
    return true;
  }
  return false;
}

void ForceTorqueSensor::complete(const can::StampedFrame& tpdo2) noexcept {
  const std::uint8_t* bytes = tpdo2.frame.data.data();
  sample_.out_of_range = false;
  for (int i = 0; i < 3; ++i) {
    const auto channel = static_cast<std::size_t>(i);
    const auto torque = get<std::int16_t>(bytes + 2 * channel);
    sample_.F_So_S.force[i] = scaled(force_raw_[channel], digits_[channel]);
    sample_.F_So_S.torque[i] = scaled(torque, digits_[channel + 3]);
    sample_.out_of_range = sample_.out_of_range || at_an_end(force_raw_[channel]) || at_an_end(torque);
  }
  sample_.counter = waiting_counter_;
  sample_.status = bytes[6];
  sample_.at = tpdo1_at_;
}

void ForceTorqueSensor::tare() noexcept {
  if (tare_state_ == TareState::kBusy) return;
  tare_state_ = TareState::kBusy;
  tare_channel_ = 0;
}

void ForceTorqueSensor::poll(Time now) noexcept {
  RemoteNode::poll(now);
  if (tare_state_ != TareState::kBusy || stage() != Stage::kStarted) return;
  if (tare_channel_ > 0) {
    if (sdo().state() == canopen::SdoClient::State::kBusy) return;
    if (sdo().state() == canopen::SdoClient::State::kFailed) {
      tare_state_ = TareState::kFailed;
      latch_request_failure();
      return;
    }
    if (tare_channel_ == kChannels) {
      tare_state_ = TareState::kDone;
      return;
    }
  }
  if (sdo().pending() != nullptr) return;
  ++tare_channel_;
  std::array<std::uint8_t, 4> bytes{};
  canopen::put(bytes.data(), kTaraSignature);
  sdo().download({object::kAutoTare, tare_channel_}, bytes, now);
}

}  // namespace walkman::ft
