#include "drivers/cia404/force_torque_sensor.h"

#include "drivers/canopen/little_endian.h"
#include "drivers/canopen/objects.h"

namespace walkman::ft {
namespace {

namespace object = canopen::object;
using canopen::SdoStep;

constexpr std::uint32_t kTaraSignature = 0x61726174;  // "tara"

double scaled(std::int16_t raw, std::uint32_t digits) {
  double value = raw;
  for (std::uint32_t i = 0; i < digits; ++i) value /= 10;
  return value;
}

}  // namespace

std::vector<SdoStep> ForceTorqueSensor::configuration_of(const canopen::NodeSettings& settings) {
  std::vector<SdoStep> steps = canopen::identity_steps_of(settings, kForceTorqueType);
  const auto append = [&steps](const std::vector<SdoStep>& more) {
    steps.insert(steps.end(), more.begin(), more.end());
  };
  append(canopen::supervision_steps(settings));
  for (std::size_t i = 0; i < kChannels; ++i) {
    append({{SdoStep::Kind::kRead,
             {object::kDecimalDigits, static_cast<std::uint8_t>(i + 1)},
             1,
             0,
             "decimal digits of the process value",
             &digits_[i]}});
  }
  append(canopen::pdo_steps(settings.pdos, settings.node_id));
  return steps;
}

ForceTorqueSensor::ForceTorqueSensor(const canopen::NodeSettings& settings)
    : RemoteNode(settings), channels_(settings.pdos, kChannels, settings.cycle) {
  set_configuration(configuration_of(settings));
}

void ForceTorqueSensor::on_begin_boot() noexcept {
  channels_.reset();
  sample_ = ForceTorqueSample{};
  tare_state_ = TareState::kIdle;
}

void ForceTorqueSensor::on_tpdo(int number, const can::StampedFrame& stamped) noexcept {
  if (!channels_.take(number, stamped)) return;
  sample_.out_of_range = false;
  for (int i = 0; i < 3; ++i) {
    const auto channel = static_cast<std::size_t>(i);
    sample_.F_So_S.force[i] = scaled(channels_.raw(channel), digits_[channel]);
    sample_.F_So_S.torque[i] = scaled(channels_.raw(channel + 3), digits_[channel + 3]);
    sample_.out_of_range =
        sample_.out_of_range || channels_.at_an_end(channel) || channels_.at_an_end(channel + 3);
  }
  sample_.counter = channels_.counter();
  sample_.status = channels_.status();
  sample_.at = channels_.at();
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
