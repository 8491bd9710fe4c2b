#include "drivers/cia404/channel_sample.h"

#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include "drivers/canopen/little_endian.h"
#include "drivers/canopen/objects.h"

namespace walkman::cia404 {

namespace object = canopen::object;
using canopen::DevicePdos;
using canopen::get;
using canopen::MappingEntry;
using canopen::PdoSettings;

ChannelSample::ChannelSample(const DevicePdos& pdos, std::size_t channels, Time cycle) : cycle_(cycle) {
  for (int number = 1; number <= 4; ++number) {
    const PdoSettings& settings = pdos.transmit[static_cast<std::size_t>(number - 1)];
    if (settings.cyclic()) take_mapping(number, settings, channels);
  }
  std::vector<MappingEntry> needed;
  for (std::size_t i = 0; i < channels; ++i) {
    needed.push_back({object::kProcessValueInt16, static_cast<std::uint8_t>(i + 1), 16});
  }
  needed.push_back({object::kCycleCounter, 1, 16});
  needed.push_back({object::kMeasuringStatus, 1, 8});
  for (const MappingEntry& object : needed) {
    int times = 0;
    for (const PdoSettings& settings : pdos.transmit) {
      if (!settings.cyclic()) continue;
      for (const MappingEntry& mapped : settings.mapping) times += mapped == object ? 1 : 0;
    }
    if (times == 1) continue;
    throw std::runtime_error(
        fmt::format("{} with {} bits is in {} TPDOs of transmission type 1 to 240, expected one",
                    name_of(object), object.bits, times == 0 ? "no" : "several"));
  }
  for (int number = 1; number <= 4; ++number) {
    const auto base = [&](int n) { return pdos.transmit[static_cast<std::size_t>(n - 1)].cob_id_base; };
    if ((all_ >> static_cast<unsigned>(number - 1) & 1U) == 0) continue;
    if (first_ == 0 || base(number) < base(first_)) first_ = number;
  }
}

void ChannelSample::take_mapping(int number, const PdoSettings& settings, std::size_t channels) {
  auto& fields = fields_[static_cast<std::size_t>(number - 1)];
  std::size_t offset = 0;
  for (const MappingEntry& object : settings.mapping) {
    Field field;
    field.offset = static_cast<std::uint8_t>(offset);
    offset += object.bits / 8U;
    if (object.index == object::kProcessValueInt16 && object.sub >= 1 && object.sub <= channels) {
      field.kind = Kind::kChannel;
      field.channel = static_cast<std::uint8_t>(object.sub - 1);
    } else if (object.index == object::kCycleCounter && object.sub == 1) {
      field.kind = Kind::kCounter;
    } else if (object.index == object::kMeasuringStatus && object.sub == 1) {
      field.kind = Kind::kStatus;
    } else {
      continue;
    }
    fields.push_back(field);
  }
  if (!fields.empty()) all_ |= 1U << static_cast<unsigned>(number - 1);
}

void ChannelSample::reset() noexcept {
  taken_ = 0;
  coming_ = complete_ = Values{};
  at_ = Time::min();
}

bool ChannelSample::belongs(int number, Time at) noexcept {
  const unsigned bit = 1U << static_cast<unsigned>(number - 1);
  if (number == first_) {
    taken_ = bit;
    taken_at_ = at;
    return true;
  }
  // Frames of one SYNC follow each other within the cycle; those of different SYNCs are a cycle apart.
  const bool same_sync =
      taken_ != 0 && (taken_ & bit) == 0 && at >= taken_at_ && at - taken_at_ < cycle_ * 3 / 4;
  if (!same_sync) {
    taken_ = 0;
    return false;
  }
  taken_ |= bit;
  return true;
}

void ChannelSample::decode(int number, const can::Frame& frame) noexcept {
  for (const Field& field : fields_[static_cast<std::size_t>(number - 1)]) {
    const std::uint8_t* bytes = frame.data.data() + field.offset;
    switch (field.kind) {
      case Kind::kChannel:
        coming_.raw[field.channel] = get<std::int16_t>(bytes);
        break;
      case Kind::kCounter:
        coming_.counter = get<std::uint16_t>(bytes);
        break;
      case Kind::kStatus:
        coming_.status = *bytes;
        break;
    }
  }
}

bool ChannelSample::take(int number, const can::StampedFrame& stamped) noexcept {
  if ((all_ >> static_cast<unsigned>(number - 1) & 1U) == 0) return false;
  if (!belongs(number, stamped.time)) return false;
  decode(number, stamped.frame);
  if (taken_ != all_) return false;
  taken_ = 0;
  if (at_ != Time::min() && coming_.counter == complete_.counter) return false;
  complete_ = coming_;
  at_ = taken_at_;
  return true;
}

bool ChannelSample::out_of_range(std::size_t channel) const noexcept {
  return raw(channel) == std::numeric_limits<std::int16_t>::min() ||
         raw(channel) == std::numeric_limits<std::int16_t>::max();
}

}  // namespace walkman::cia404
