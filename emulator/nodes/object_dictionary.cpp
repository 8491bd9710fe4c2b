#include "emulator/nodes/object_dictionary.h"

#include <algorithm>
#include <stdexcept>

namespace walkman::nodes {
namespace {

std::uint32_t key(ObjectAddress address) noexcept { return std::uint32_t{address.index} << 8U | address.sub; }

auto place(const std::vector<std::unique_ptr<Entry>>& entries, ObjectAddress address) noexcept {
  return std::lower_bound(
      entries.begin(), entries.end(), key(address),
      [](const std::unique_ptr<Entry>& entry, std::uint32_t wanted) { return key(entry->address) < wanted; });
}

std::int64_t integer_value(DataType type, std::uint32_t raw) noexcept {
  switch (type) {
    case DataType::kInteger8:
      return from_raw<std::int8_t>(raw);
    case DataType::kInteger16:
      return from_raw<std::int16_t>(raw);
    case DataType::kInteger32:
      return from_raw<std::int32_t>(raw);
    default:
      return raw;
  }
}

}  // namespace

std::size_t Entry::size() const noexcept {
  switch (type) {
    case DataType::kInteger8:
    case DataType::kUnsigned8:
      return 1;
    case DataType::kInteger16:
    case DataType::kUnsigned16:
      return 2;
    case DataType::kVisibleString:
      return text.size();
    default:
      return 4;
  }
}

Entry& ObjectDictionary::insert(ObjectAddress address, DataType type, Access access, Mappable mappable) {
  const auto at = place(entries_, address);
  if (at != entries_.end() && (*at)->address == address) {
    throw std::runtime_error("object dictionary: entry " + std::to_string(address.index) + " sub " +
                             std::to_string(address.sub) + " added twice, expected once");
  }
  auto entry = std::make_unique<Entry>();
  entry->address = address;
  entry->type = type;
  entry->access = access;
  entry->mappable = mappable;
  return **entries_.insert(at, std::move(entry));
}

void ObjectDictionary::add_text(std::uint16_t index, std::uint8_t sub, std::string text) {
  insert({index, sub}, DataType::kVisibleString, Access::kConst, Mappable::kNo).text = std::move(text);
}

const Entry* ObjectDictionary::find(std::uint16_t index, std::uint8_t sub) const noexcept {
  const auto at = place(entries_, {index, sub});
  if (at == entries_.end() || (*at)->address != ObjectAddress{index, sub}) return nullptr;
  return at->get();
}

Entry* ObjectDictionary::find(std::uint16_t index, std::uint8_t sub) noexcept {
  const auto at = place(entries_, {index, sub});
  if (at == entries_.end() || (*at)->address != ObjectAddress{index, sub}) return nullptr;
  return at->get();
}

SdoAbort ObjectDictionary::missing(std::uint16_t index) const noexcept {
  const auto at = place(entries_, {index, 0});
  const bool object_exists = at != entries_.end() && (*at)->address.index == index;
  return object_exists ? SdoAbort::kNoSubIndex : SdoAbort::kNoObject;
}

Verdict ObjectDictionary::write(Entry& entry, std::span<const std::uint8_t> bytes) noexcept {
  if (!entry.writable()) return SdoAbort::kReadOnly;
  if (bytes.size() > entry.size()) return SdoAbort::kTooLong;
  if (bytes.size() < entry.size()) return SdoAbort::kTooShort;
  std::uint32_t raw = 0;
  std::memcpy(&raw, bytes.data(), bytes.size());
  if (entry.type != DataType::kReal32) {
    const std::int64_t value = integer_value(entry.type, raw);
    if (value > entry.highest) return SdoAbort::kTooHigh;
    if (value < entry.lowest) return SdoAbort::kTooLow;
  }
  if (entry.write_hook) {
    if (const Verdict refused = entry.write_hook(raw)) return refused;
  }
  entry.raw = raw;
  return std::nullopt;
}

Verdict ObjectDictionary::read(const Entry& entry) const noexcept {
  if (!entry.readable()) return SdoAbort::kWriteOnly;
  if (entry.read_hook) return entry.read_hook();
  return std::nullopt;
}

void ObjectDictionary::restore_defaults(std::uint16_t first, std::uint16_t last) noexcept {
  for (const auto& entry : entries_) {
    if (entry->address.index < first || entry->address.index > last || !entry->writable()) continue;
    entry->raw = entry->default_raw;
  }
}

}  // namespace walkman::nodes
