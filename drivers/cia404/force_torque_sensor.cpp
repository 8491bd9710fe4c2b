#include "drivers/cia404/force_torque_sensor.h"

#include "drivers/canopen/objects.h"

namespace walkman::cia404 {
namespace {

namespace object = canopen::object;
using canopen::SdoStep;

double scaled(std::int16_t raw, std::uint32_t digits) {
  double value = raw;
  for (std::uint32_t i = 0; i < digits; ++i) value /= 10;
  return value;
}

}  // namespace

ForceTorqueSensor::ForceTorqueSensor(const canopen::NodeSettings& settings)
    : MeasuringDevice(settings, kChannels) {
  std::vector<SdoStep> digits;
  for (std::size_t i = 0; i < kChannels; ++i) {
    digits.push_back({SdoStep::Kind::kRead,
                      {object::kDecimalDigits, static_cast<std::uint8_t>(i + 1)},
                      1,
                      0,
                      "decimal digits of the process value",
                      &digits_[i]});
  }
  set_measuring_steps(digits);
}

bool ForceTorqueSensor::decode(const ChannelSample& channels) noexcept {
  for (int i = 0; i < 3; ++i) {
    const auto channel = static_cast<std::size_t>(i);
    sample_.F_So_S.force[i] = scaled(channels.raw(channel), digits_[channel]);
    sample_.F_So_S.torque[i] = scaled(channels.raw(channel + 3), digits_[channel + 3]);
  }
  return true;
}

}  // namespace walkman::cia404
