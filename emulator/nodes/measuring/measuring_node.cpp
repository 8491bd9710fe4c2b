#include "emulator/nodes/measuring/measuring_node.h"

#include <algorithm>

#include "drivers/canopen/objects.h"
#include "emulator/nodes/measuring/measuring_table.h"

namespace walkman::nodes {

namespace object = canopen::object;

namespace {

// Manufacturer's EMCY codes.
constexpr std::uint16_t kOverRange = 0xFF01;
constexpr std::uint16_t kNoReading = 0xFF02;

constexpr std::uint8_t kOverload = measuring_status::kPositiveOverload | measuring_status::kNegativeOverload;

}  // namespace

MeasuringNode::MeasuringNode(DeviceIdentity identity, std::span<const ChannelDescription> channels,
                             std::uint32_t sample_period_us)
    : CanopenSlave(std::move(identity)) {
  const auto count = [&](auto has) {
    return static_cast<std::uint8_t>(std::count_if(channels.begin(), channels.end(), has));
  };
  AnalogueChannel::add_objects(objects(), static_cast<std::uint8_t>(channels.size()),
                               count([](const ChannelDescription& c) { return c.digits.has_value(); }),
                               count([](const ChannelDescription& c) { return c.adjustable; }));
  for (const ChannelDescription& description : channels) {
    const auto number = static_cast<std::uint8_t>(channels_.size() + 1);
    channels_.push_back(std::make_unique<AnalogueChannel>(objects(), number, description, sample_period_us));
  }
  objects().add(sample_counter_table());
  counter_ = objects().object<std::uint16_t>(object::kCycleCounter, 1);
}

CanopenSlave::PdoSet MeasuringNode::vector_tpdos() {
  constexpr std::uint16_t kValue = object::kProcessValueInt16;
  PdoSet transmit;
  transmit[0] = {true,
                 1,
                 0,
                 {mapped(kValue, 1, 16), mapped(kValue, 2, 16), mapped(kValue, 3, 16),
                  mapped(object::kCycleCounter, 1, 16)}};
  transmit[1] = {true,
                 1,
                 0,
                 {mapped(kValue, 4, 16), mapped(kValue, 5, 16), mapped(kValue, 6, 16),
                  mapped(object::kMeasuringStatus, 1, 8)}};
  return transmit;
}

void MeasuringNode::take_sample(std::span<const double> readings) noexcept {
  std::uint8_t all = 0;
  bool silent = false;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    AnalogueChannel& channel = *channels_[i];
    const std::uint8_t status = channel.sample(readings[i]);
    channel.set_status(status);
    all |= status;
    silent = silent || (channel.on() && status == measuring_status::kInvalid);
  }
  channels_.front()->set_status(all);
  counter_.set(static_cast<std::uint16_t>(counter_.get() + 1));
  // After all channels, so that a PDO sent for one of them carries the others' values of the same sample.
  for (const auto& channel : channels_) {
    if (!channel->event()) continue;
    for (const Entry* entry : channel->process_value_entries()) {
      if (entry != nullptr) signal_change(*entry);
    }
  }
  // New errors first: while one is left, no "error-free" message is sent in between.
  const bool over_range = (all & kOverload) != 0;
  if (over_range) raise(kOverRange, error_register::kManufacturer);
  if (silent) raise(kNoReading, error_register::kManufacturer);
  if (!over_range) clear(kOverRange);
  if (!silent) clear(kNoReading);
}

void MeasuringNode::on_reset() noexcept {
  counter_.set(0);
  for (const auto& channel : channels_) channel->reset();
}

}  // namespace walkman::nodes
