#include "emulator/nodes/measuring/analogue_channel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>

#include "drivers/canopen/objects.h"
#include "emulator/nodes/drive/wire_units.h"

namespace walkman::nodes {

namespace object = canopen::object;

namespace {

constexpr auto kRo = Access::kReadOnly;
constexpr auto kRw = Access::kReadWrite;
constexpr auto kMap = Mappable::kYes;

constexpr std::uint32_t kTaraSignature = 0x61726174;
constexpr std::uint32_t kZeroSignature = 0x6F72657A;
constexpr std::uint8_t kFirstOrder = 1;
constexpr std::uint8_t kSecondOrder = 2;
constexpr std::uint16_t kFilterConstantMs = 10;

}  // namespace

void AnalogueChannel::add_counts(ObjectDictionary& dictionary, std::uint8_t channels, std::uint8_t digits,
                                 std::uint8_t adjustable) {
  const auto add = [&](std::initializer_list<std::uint16_t> indices, std::uint8_t count) {
    for (const std::uint16_t index : indices) dictionary.add<std::uint8_t>(index, 0, Access::kConst, count);
  };
  add({0x6110, 0x6112, 0x6114, object::kProcessValueReal, 0x6131, 0x6133, 0x6134, 0x6135, 0x6148, 0x6149,
       object::kMeasuringStatus, object::kProcessValueInt16, 0x9130},
      channels);
  if (digits > 0) add({object::kDecimalDigits}, digits);
  if (adjustable == 0) return;
  add({0x6100, 0x6124, 0x6125, 0x6126, 0x6127, object::kTare, object::kAutoTare, 0x6140, 0x61A0, 0x61A1,
       0x7100},
      adjustable);
}

AnalogueChannel::AnalogueChannel(ObjectDictionary& dictionary, std::uint8_t channel,
                                 const ChannelDescription& description, std::uint32_t sample_period_us)
    : channel_(channel), description_(description), sample_period_(sample_period_us * kMicro) {
  add_measurement(dictionary, sample_period_us);
  add_events(dictionary);
  if (description.adjustable) add_adjustment(dictionary);
}

void AnalogueChannel::add_measurement(ObjectDictionary& d, std::uint32_t sample_period_us) {
  const auto range = static_cast<float>(description_.range);
  d.add<std::uint16_t>(0x6110, channel_, kRo, description_.sensor_type);
  operating_mode_ = d.add<std::uint8_t>(0x6112, channel_, kRw, 1).limits(0, 1);
  d.add<std::uint32_t>(0x6114, channel_, kRo, sample_period_us);
  process_value_ = d.add<float>(object::kProcessValueReal, channel_, kRo, 0, kMap);
  d.add<std::uint32_t>(0x6131, channel_, kRo, description_.unit_code);
  if (description_.digits) {
    d.add<std::uint8_t>(object::kDecimalDigits, channel_, kRo, *description_.digits);
  }
  d.add<float>(0x6148, channel_, kRo, -range);
  d.add<float>(0x6149, channel_, kRo, range);
  status_ = d.add<std::uint8_t>(object::kMeasuringStatus, channel_, kRo, measuring_status::kInvalid, kMap);
  process_value_i16_ = d.add<std::int16_t>(object::kProcessValueInt16, channel_, kRo, 0, kMap);
  process_value_i32_ = d.add<std::int32_t>(0x9130, channel_, kRo, 0, kMap);
}

void AnalogueChannel::add_events(ObjectDictionary& d) {
  const auto range = static_cast<float>(description_.range);
  event_delta_ = d.add<float>(0x6133, channel_, kRw, 0);
  event_delta_.on_write([](float delta) -> Verdict {
    if (!std::isfinite(delta) || delta < 0) return SdoAbort::kValue;
    return std::nullopt;
  });
  lower_limit_ = d.add<float>(0x6134, channel_, kRw, -range);
  lower_limit_.on_write([this](float limit) -> Verdict {
    if (!std::isfinite(limit)) return SdoAbort::kValue;
    return limit > upper_limit_.get() ? Verdict{SdoAbort::kMaxBelowMin} : std::nullopt;
  });
  upper_limit_ = d.add<float>(0x6135, channel_, kRw, range);
  upper_limit_.on_write([this](float limit) -> Verdict {
    if (!std::isfinite(limit)) return SdoAbort::kValue;
    return limit < lower_limit_.get() ? Verdict{SdoAbort::kMaxBelowMin} : std::nullopt;
  });
}

void AnalogueChannel::add_adjustment(ObjectDictionary& d) {
  field_value_ = d.add<float>(0x6100, channel_, kRo, 0, kMap);
  field_value_i16_ = d.add<std::int16_t>(0x7100, channel_, kRo, 0, kMap);
  net_value_ = d.add<float>(0x6140, channel_, kRo, 0, kMap);
  input_offset_ = d.add<float>(0x6124, channel_, kRw, 0);
  factor_ = d.add<float>(0x6126, channel_, kRw, 1);
  scaling_offset_ = d.add<float>(0x6127, channel_, kRw, 0);
  tare_ = d.add<float>(object::kTare, channel_, kRw, 0);
  filter_type_ = d.add<std::uint8_t>(0x61A0, channel_, kRw, 0).limits(0, kSecondOrder);
  filter_constant_ = d.add<std::uint16_t>(0x61A1, channel_, kRw, kFilterConstantMs);

  const auto adjusts = [this](Object<float>& parameter) {
    parameter.on_write([this, &parameter](float value) -> Verdict {
      const bool usable = std::isfinite(value) && (&parameter != &factor_ || value != 0);
      if (!usable) return SdoAbort::kValue;
      parameter.set(value);
      publish();
      return std::nullopt;
    });
  };
  adjusts(input_offset_);
  adjusts(factor_);
  adjusts(scaling_offset_);
  adjusts(tare_);
  auto command = [this, &d](std::uint16_t index, std::uint32_t signature, Object<float>& parameter,
                            float sign) {
    d.add<std::uint32_t>(index, channel_, Access::kWriteOnly, 0)
        .on_write([this, signature, &parameter, sign](std::uint32_t value) -> Verdict {
          if (value != signature) return SdoAbort::kValue;
          parameter.set(parameter.get() + sign * process_value_.get());
          publish();
          return std::nullopt;
        });
  };
  command(0x6125, kZeroSignature, input_offset_, -1);
  command(object::kAutoTare, kTaraSignature, tare_, 1);
}

std::uint8_t AnalogueChannel::sample(double reading) noexcept {
  if (!on() || !std::isfinite(reading)) {
    settled_ = false;
    return measuring_status::kInvalid;
  }
  const double range = description_.range;
  std::uint8_t status = 0;
  if (reading > range) status |= measuring_status::kPositiveOverload;
  if (reading < -range) status |= measuring_status::kNegativeOverload;
  const double inside = std::clamp(reading, -range, range);
  const double step = description_.resolution;
  const double resolved = step > 0 ? std::round(inside / step) * step : inside;
  filter(resolved);
  settled_ = true;
  fresh_ = true;
  publish();
  return status;
}

void AnalogueChannel::filter(double resolved) noexcept {
  const bool on = description_.adjustable && filter_type_.get() != 0 && filter_constant_.get() > 0;
  if (!on || !settled_) {
    first_stage_ = filtered_ = resolved;
    return;
  }
  const double weight = 1 - std::exp(-sample_period_ / (filter_constant_.get() * kMilli));
  first_stage_ += weight * (resolved - first_stage_);
  if (filter_type_.get() == kFirstOrder) {
    filtered_ = first_stage_;
  } else {
    filtered_ += weight * (first_stage_ - filtered_);
  }
}

void AnalogueChannel::publish() noexcept {
  auto value = static_cast<float>(filtered_);
  if (description_.adjustable) {
    field_value_.set(value);
    field_value_i16_.set(to_wire<std::int16_t>(value, description_.wire_unit));
    const double gross = double{factor_.get()} * value + scaling_offset_.get() + input_offset_.get();
    value = static_cast<float>(gross - tare_.get());
    net_value_.set(value);
  }
  process_value_.set(value);
  process_value_i16_.set(to_wire<std::int16_t>(value, description_.wire_unit));
  process_value_i32_.set(to_wire<std::int32_t>(value, description_.wire_unit));
}

bool AnalogueChannel::event() noexcept {
  if (!fresh_) return false;
  fresh_ = false;
  const float value = process_value_.get();
  const int zone = value < lower_limit_.get() ? -1 : value > upper_limit_.get() ? 1 : 0;
  const float delta = event_delta_.get();
  const bool moved = delta > 0 && std::abs(value - last_event_) > delta;
  if (!moved && zone == zone_) return false;
  last_event_ = value;
  zone_ = zone;
  return true;
}

void AnalogueChannel::reset() noexcept {
  settled_ = fresh_ = false;
  status_.set(measuring_status::kInvalid);
}

std::array<const Entry*, 4> AnalogueChannel::process_value_entries() const noexcept {
  return {&process_value_.entry(), &process_value_i16_.entry(), &process_value_i32_.entry(),
          description_.adjustable ? &net_value_.entry() : nullptr};
}

}  // namespace walkman::nodes
