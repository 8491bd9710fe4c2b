#include "emulator/nodes/force_torque_node.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "drivers/canopen/objects.h"
#include "emulator/nodes/wire_units.h"

namespace walkman::nodes {

namespace object = canopen::object;

namespace {

constexpr std::uint32_t kAnalogueInputType = 0x00020194;
constexpr std::uint32_t kTaraSignature = 0x61726174;

// CiA 303-2: 21h is newton. It has no code of its own for the newton metre known to us; 23h is the joule,
// which has the same dimension.
constexpr std::uint32_t kNewton = 0x00210000;
constexpr std::uint32_t kNewtonMetre = 0x00230000;
constexpr double kForceUnit = 0.1;
constexpr double kTorqueUnit = 0.01;

constexpr std::uint8_t kInvalid = 1;
constexpr std::uint8_t kPositiveOverload = 2;
constexpr std::uint8_t kNegativeOverload = 4;
constexpr std::uint16_t kOverRange = 0xFF01;

constexpr std::uint8_t kLowPass = 1;

}  // namespace

ForceTorqueNode::ForceTorqueNode(const ForceTorqueParameters& parameters)
    : CanopenSlave({parameters.node_id, kAnalogueInputType, parameters.name, 2, parameters.serial}),
      parameters_(parameters),
      generator_(parameters.noise_seed) {
  const std::initializer_list<std::uint16_t> per_channel = {0x6100,
                                                            0x6112,
                                                            object::kProcessValueReal,
                                                            0x6131,
                                                            0x6132,
                                                            object::kTare,
                                                            object::kAutoTare,
                                                            0x6148,
                                                            0x6149,
                                                            object::kMeasuringStatus,
                                                            0x61A0,
                                                            0x61A1,
                                                            object::kProcessValueInt16};
  for (const std::uint16_t index : per_channel) {
    objects().add<std::uint8_t>(index, 0, Access::kConst, kChannels);
  }
  for (std::size_t i = 0; i < kChannels; ++i) add_channel(i);
  objects().add<std::uint32_t>(0x6114, 0, Access::kReadOnly, parameters_.sample_period_us);
  objects().add<std::uint8_t>(object::kCycleCounter, 0, Access::kConst, 1);
  counter_ = objects().add<std::uint16_t>(object::kCycleCounter, 1, Access::kReadOnly, 0, Mappable::kYes);

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
  configure_pdos({}, transmit);
}

void ForceTorqueNode::add_channel(std::size_t i) {
  ObjectDictionary& d = objects();
  Channel& channel = channels_[i];
  const auto sub = static_cast<std::uint8_t>(i + 1);
  const bool force = i < 3;
  channel.rating = parameters_.channels[i];
  channel.unit = force ? kForceUnit : kTorqueUnit;
  const auto range = static_cast<float>(channel.rating.range);

  channel.field_value = d.add<float>(0x6100, sub, Access::kReadOnly, 0, Mappable::kYes);
  channel.operating_mode = d.add<std::uint8_t>(0x6112, sub, Access::kReadWrite, 1).limits(0, 1);
  channel.process_value = d.add<float>(object::kProcessValueReal, sub, Access::kReadOnly, 0, Mappable::kYes);
  d.add<std::uint32_t>(0x6131, sub, Access::kReadOnly, force ? kNewton : kNewtonMetre);
  d.add<std::uint8_t>(0x6132, sub, Access::kReadOnly, force ? 1 : 2);
  d.add<float>(0x6148, sub, Access::kReadOnly, -range);
  d.add<float>(0x6149, sub, Access::kReadOnly, range);
  channel.status =
      d.add<std::uint8_t>(object::kMeasuringStatus, sub, Access::kReadOnly, kInvalid, Mappable::kYes);
  channel.filter_type = d.add<std::uint8_t>(0x61A0, sub, Access::kReadWrite, 0).limits(0, kLowPass);
  channel.filter_constant = d.add<std::uint16_t>(0x61A1, sub, Access::kReadWrite, 10);
  channel.process_value_i16 =
      d.add<std::int16_t>(object::kProcessValueInt16, sub, Access::kReadOnly, 0, Mappable::kYes);

  channel.tare = d.add<float>(object::kTare, sub, Access::kReadWrite, 0);
  channel.tare.on_write([this, &channel](float value) -> Verdict {
    if (!std::isfinite(value)) return SdoAbort::kValue;
    publish_process_value(channel, value);
    return std::nullopt;
  });
  auto auto_tare = d.add<std::uint32_t>(object::kAutoTare, sub, Access::kWriteOnly, 0);
  auto_tare.on_write([this, &channel](std::uint32_t value) -> Verdict {
    if (value != kTaraSignature) return SdoAbort::kValue;
    channel.tare.set(channel.field_value.get());
    publish_process_value(channel, channel.tare.get());
    return std::nullopt;
  });
}

void ForceTorqueNode::sample(const Wrench& F_So_S) noexcept {
  std::uint8_t any = 0;
  for (std::size_t i = 0; i < kChannels; ++i) {
    const auto axis = static_cast<Eigen::Index>(i % 3);
    const double load = i < 3 ? F_So_S.force[axis] : F_So_S.torque[axis];
    const double noise = parameters_.noise * channels_[i].rating.resolution * normal_(generator_);
    const std::uint8_t status = sample_channel(channels_[i], load + parameters_.residual[i] + noise);
    channels_[i].status.set(status);
    any |= status;
  }
  channels_[0].status.set(any);
  counter_.set(static_cast<std::uint16_t>(counter_.get() + 1));
  if ((any & (kPositiveOverload | kNegativeOverload)) != 0) {
    raise(kOverRange, error_register::kManufacturer);
  } else {
    clear(kOverRange);
  }
}

std::uint8_t ForceTorqueNode::sample_channel(Channel& channel, double load) noexcept {
  if (channel.operating_mode.get() == 0 || !std::isfinite(load)) {
    channel.settled = false;
    return kInvalid;
  }
  std::uint8_t status = 0;
  if (load > channel.rating.range) status |= kPositiveOverload;
  if (load < -channel.rating.range) status |= kNegativeOverload;
  const double inside = std::clamp(load, -channel.rating.range, channel.rating.range);
  const double resolved = std::round(inside / channel.rating.resolution) * channel.rating.resolution;

  const double time_constant = channel.filter_constant.get() * kMilli;
  const bool filter = channel.filter_type.get() == kLowPass && channel.settled && time_constant > 0;
  const double period = parameters_.sample_period_us * kMicro;
  const double weight = filter ? 1 - std::exp(-period / time_constant) : 1;
  channel.filtered += weight * (resolved - channel.filtered);
  channel.settled = true;

  channel.field_value.set(static_cast<float>(channel.filtered));
  publish_process_value(channel, channel.tare.get());
  return status;
}

void ForceTorqueNode::publish_process_value(Channel& channel, double tare) noexcept {
  const double net = channel.field_value.get() - tare;
  channel.process_value.set(static_cast<float>(net));
  channel.process_value_i16.set(to_wire<std::int16_t>(net, channel.unit));
}

void ForceTorqueNode::on_reset() noexcept {
  counter_.set(0);
  for (Channel& channel : channels_) {
    channel.settled = false;
    channel.status.set(kInvalid);
  }
}

}  // namespace walkman::nodes
