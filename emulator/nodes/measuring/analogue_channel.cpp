#include "emulator/nodes/measuring/analogue_channel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>

#include "drivers/canopen/objects.h"
#include "emulator/nodes/measuring/measuring_table.h"

namespace walkman::nodes {

namespace object = canopen::object;

namespace {

constexpr std::uint32_t kTaraSignature = 0x61726174;
constexpr std::uint32_t kZeroSignature = 0x6F72657A;
constexpr std::uint8_t kFirstOrder = 1;

}  // namespace

void AnalogueChannel::add_objects(ObjectDictionary& dictionary, std::uint8_t channels, std::uint8_t digits,
                                  std::uint8_t adjustable) {
  const auto add = [&](ObjectTable table, std::uint8_t count) {
    if (count == 0) return;
    for (const ObjectRow& row : table) dictionary.add(row, count);
  };
  add(channel_table(), channels);
  add(digits_table(), digits);
  add(adjustment_table(), adjustable);
}

AnalogueChannel::AnalogueChannel(ObjectDictionary& dictionary, std::uint8_t channel,
                                 const ChannelDescription& description, std::uint32_t sample_period_us)
    : channel_(channel), description_(description), sample_period_(sample_period_us * kMicro) {
  bind_measurement(dictionary, sample_period_us);
  bind_events(dictionary);
  if (description.adjustable) bind_adjustment(dictionary);
}

void AnalogueChannel::bind_measurement(ObjectDictionary& d, std::uint32_t sample_period_us) {
  const auto range = static_cast<float>(description_.range);
  d.object<std::uint16_t>(0x6110, channel_).factory(description_.sensor_type);
  operating_mode_ = d.object<std::uint8_t>(0x6112, channel_);
  d.object<std::uint32_t>(0x6114, channel_).factory(sample_period_us);
  process_value_ = d.object<float>(object::kProcessValueReal, channel_);
  d.object<std::uint32_t>(0x6131, channel_).factory(description_.unit_code);
  if (description_.digits)
    d.object<std::uint8_t>(object::kDecimalDigits, channel_).factory(*description_.digits);
  d.object<float>(0x6148, channel_).factory(-range);
  d.object<float>(0x6149, channel_).factory(range);
  status_ = d.object<std::uint8_t>(object::kMeasuringStatus, channel_);
  process_value_i16_ = d.object<std::int16_t>(object::kProcessValueInt16, channel_);
  process_value_i32_ = d.object<std::int32_t>(0x9130, channel_);
}

void AnalogueChannel::bind_events(ObjectDictionary& d) {
  const auto range = static_cast<float>(description_.range);
  event_delta_ = d.object<float>(0x6133, channel_);
  event_delta_.on_write([](float delta) -> Refusal {
    if (!std::isfinite(delta) || delta < 0) return SdoAbort::kValue;
    return std::nullopt;
  });
  lower_limit_ = d.object<float>(0x6134, channel_).factory(-range);
  lower_limit_.on_write([this](float limit) -> Refusal {
    if (!std::isfinite(limit)) return SdoAbort::kValue;
    return limit > upper_limit_.get() ? Refusal{SdoAbort::kMaxBelowMin} : std::nullopt;
  });
  upper_limit_ = d.object<float>(0x6135, channel_).factory(range);
  upper_limit_.on_write([this](float limit) -> Refusal {
    if (!std::isfinite(limit)) return SdoAbort::kValue;
    return limit < lower_limit_.get() ? Refusal{SdoAbort::kMaxBelowMin} : std::nullopt;
  });
}

void AnalogueChannel::bind_adjustment(ObjectDictionary& d) {
  field_value_ = d.object<float>(0x6100, channel_);
  field_value_i16_ = d.object<std::int16_t>(0x7100, channel_);
  net_value_ = d.object<float>(0x6140, channel_);
  input_offset_ = d.object<float>(0x6124, channel_);
  factor_ = d.object<float>(0x6126, channel_);
  scaling_offset_ = d.object<float>(0x6127, channel_);
  tare_ = d.object<float>(object::kTare, channel_);
  filter_type_ = d.object<std::uint8_t>(0x61A0, channel_);
  filter_constant_ = d.object<std::uint16_t>(0x61A1, channel_);

  const auto adjusts = [this](Object<float>& parameter) {
    parameter.on_write([this, &parameter](float value) -> Refusal {
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
    d.object<std::uint32_t>(index, channel_)
        .on_write([this, signature, &parameter, sign](std::uint32_t value) -> Refusal {
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
    has_reading_ = false;
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
  has_reading_ = true;
  fresh_ = true;
  publish();
  return status;
}

void AnalogueChannel::filter(double resolved) noexcept {
  const bool on = description_.adjustable && filter_type_.get() != 0 && filter_constant_.get() > 0;
  if (!on || !has_reading_) {
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
  has_reading_ = fresh_ = false;
  status_.set(measuring_status::kInvalid);
}

std::array<const Entry*, 4> AnalogueChannel::process_value_entries() const noexcept {
  return {&process_value_.entry(), &process_value_i16_.entry(), &process_value_i32_.entry(),
          description_.adjustable ? &net_value_.entry() : nullptr};
}

}  // namespace walkman::nodes
