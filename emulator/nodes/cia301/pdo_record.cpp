#include "emulator/nodes/cia301/pdo_record.h"

#include <stdexcept>

#include "drivers/canopen/objects.h"
#include "emulator/nodes/cia301/communication_table.h"

namespace walkman::nodes {
namespace {

/// Bytes of the dummy types 0002h..0007h (CiA 301, table 44); 0 for anything else.
std::uint8_t dummy_bytes(std::uint16_t index) noexcept {
  switch (index) {
    case 0x0002:
    case 0x0005:
      return 1;
    case 0x0003:
    case 0x0006:
      return 2;
    case 0x0004:
    case 0x0007:
      return 4;
    default:
      return 0;
  }
}

}  // namespace

PdoRecord::PdoRecord(ObjectDictionary& dictionary, Direction direction, int number, std::uint32_t cob_id,
                     const PdoDefaults& defaults)
    : dictionary_(dictionary),
      direction_(direction),
      mapping_index_(
          static_cast<std::uint16_t>((direction == Direction::kTransmit ? 0x1A00 : 0x1600) + number - 1)) {
  bind_communication_record(cob_id, defaults, number);
  bind_mapping_record(defaults, number);
  reload();
  if (count_ != defaults.mapping.size()) {
    throw std::runtime_error(
        "PDO " + std::to_string(number) +
        ": default mapping rejected, expected mappable objects of at most 8 bytes in total");
  }
}

void PdoRecord::use_fd() {
  fd_ = true;
  for (std::size_t i = kClassicalObjects; i < kMaxObjects; ++i) {
    dictionary_.extend(mapping_index_);
    bind_mapping_entry(i, 0);
  }
}

bool PdoRecord::type_offered(std::uint8_t type) const noexcept {
  const bool remote = type == 252 || type == 253;
  return type <= 240 || type >= 254 || (remote && direction_ == Direction::kTransmit);
}

void PdoRecord::bind_communication_record(std::uint32_t cob_id, const PdoDefaults& defaults, int number) {
  const bool transmit = direction_ == Direction::kTransmit;
  const auto index = static_cast<std::uint16_t>((transmit ? 0x1800 : 0x1400) + number - 1);
  const std::uint32_t flags = (transmit ? kCobIdNoRtr : 0) | (defaults.enabled ? 0 : kCobIdInvalid);

  cob_id_ = dictionary_.object<std::uint32_t>(index, 1).factory(cob_id | flags);
  cob_id_.on_write([this](std::uint32_t value) -> Refusal {
    if (const Refusal refused = check_cob_id(value, cob_id_.get(), kCobIdInvalid | kCobIdNoRtr))
      return refused;
    take_cob_id(value);
    changed();
    return std::nullopt;
  });
  type_ = dictionary_.object<std::uint8_t>(index, 2).factory(defaults.type);
  type_.on_write([this](std::uint8_t value) -> Refusal {
    if (!type_offered(value)) return SdoAbort::kValue;
    type_value_ = value;
    changed();
    return std::nullopt;
  });
  inhibit_ = dictionary_.object<std::uint16_t>(index, 3);
  inhibit_.on_write([this](std::uint16_t value) -> Refusal {
    if (valid_) return SdoAbort::kDeviceState;
    inhibit_time_ = std::chrono::microseconds(100) * value;
    return std::nullopt;
  });
  event_ = dictionary_.object<std::uint16_t>(index, 5).factory(defaults.event_time_ms);
  event_.on_write([this](std::uint16_t value) -> Refusal {
    event_time_ = std::chrono::milliseconds(value);
    changed();
    return std::nullopt;
  });
  if (!transmit) return;
  sync_start_ = dictionary_.object<std::uint8_t>(index, 6);
  sync_start_.on_write([this](std::uint8_t value) -> Refusal {
    if (valid_) return SdoAbort::kDeviceState;
    sync_start_value_ = value;
    return std::nullopt;
  });
}

void PdoRecord::bind_mapping_record(const PdoDefaults& defaults, int number) {
  if (defaults.mapping.size() > kClassicalObjects) {
    throw std::runtime_error("PDO " + std::to_string(number) + ": default mapping of " +
                             std::to_string(defaults.mapping.size()) + " objects, expected at most 8");
  }
  mapping_count_ = dictionary_.object<std::uint8_t>(mapping_index_, 0)
                       .factory(static_cast<std::uint8_t>(defaults.mapping.size()));
  mapping_count_.on_write([this](std::uint8_t value) -> Refusal {
    if (valid_) return SdoAbort::kDeviceState;
    return resolve_all(value);
  });
  for (std::size_t i = 0; i < kClassicalObjects; ++i) {
    bind_mapping_entry(i, i < defaults.mapping.size() ? defaults.mapping[i] : 0);
  }
}

void PdoRecord::bind_mapping_entry(std::size_t i, std::uint32_t value) {
  const auto sub = static_cast<std::uint8_t>(i + 1);
  mapping_[i] = dictionary_.object<std::uint32_t>(mapping_index_, sub).factory(value);
  mapping_[i].on_write([this](std::uint32_t entry) -> Refusal {
    if (valid_ || mapping_count_.get() != 0) return SdoAbort::kDeviceState;
    MappedEntry object;
    return entry == 0 ? Refusal{} : resolve(entry, object);
  });
}

Refusal PdoRecord::resolve(std::uint32_t entry, MappedEntry& object) const noexcept {
  const auto index = static_cast<std::uint16_t>(entry >> 16U);
  const auto sub = static_cast<std::uint8_t>(entry >> 8U & 0xFFU);
  const std::uint32_t bits = entry & 0xFFU;
  if (direction_ == Direction::kReceive && sub == 0 && dummy_bytes(index) != 0) {
    if (bits != 8U * dummy_bytes(index)) return SdoAbort::kNotMappable;
    object = {nullptr, dummy_bytes(index)};
    return std::nullopt;
  }
  Entry* found = dictionary_.find(index, sub);
  if (found == nullptr) return dictionary_.missing(index);
  const bool direction_fits = direction_ == Direction::kTransmit ? found->readable() : found->writable();
  if (found->mappable == Mappable::kNo || !found->number() || !direction_fits || bits != 8 * found->size()) {
    return SdoAbort::kNotMappable;
  }
  object = {found, static_cast<std::uint8_t>(found->size())};
  return std::nullopt;
}

Refusal PdoRecord::resolve_all(std::size_t count) noexcept {
  if (count > (fd_ ? kMaxObjects : kClassicalObjects)) return SdoAbort::kPdoLength;
  std::array<MappedEntry, kMaxObjects> objects{};
  std::size_t bytes = 0;
  bool protects = false;
  for (std::size_t i = 0; i < count; ++i) {
    if (const Refusal refused = resolve(mapping_[i].get(), objects[i])) return refused;
    bytes += objects[i].bytes;
    const bool protection = mapping_[i].get() >> 16U == canopen::object::kPdoProtection;
    if (protection && i + 1 < count) return SdoAbort::kNotMappable;
    protects = protects || protection;
  }
  if (bytes > (fd_ ? kMaxBytes : kClassicalBytes)) return SdoAbort::kPdoLength;
  objects_ = objects;
  count_ = count;
  bytes_ = bytes;
  protects_ = protects;
  return std::nullopt;
}

void PdoRecord::take_cob_id(std::uint32_t value) noexcept {
  valid_ = (value & kCobIdInvalid) == 0;
  remote_allowed_ = (value & kCobIdNoRtr) == 0;
  identifier_ = value & kCobIdMask;
}

void PdoRecord::reload() noexcept {
  take_cob_id(cob_id_.get());
  type_value_ = type_.get();
  inhibit_time_ = std::chrono::microseconds(100) * inhibit_.get();
  event_time_ = std::chrono::milliseconds(event_.get());
  if (direction_ == Direction::kTransmit) sync_start_value_ = sync_start_.get();
  static_cast<void>(resolve_all(mapping_count_.get()));
  changed();
}

bool PdoRecord::maps(const Entry& entry) const noexcept {
  for (const MappedEntry& object : objects()) {
    if (object.entry == &entry) return true;
  }
  return false;
}

}  // namespace walkman::nodes
