#include "emulator/nodes/cia301/object_dictionary.h"

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

/// Characters of a VISIBLE_STRING (CiA 301, table 44).
bool visible(std::span<const std::uint8_t> bytes) noexcept {
  return std::all_of(bytes.begin(), bytes.end(),
                     [](std::uint8_t c) { return c == 0 || (c >= 0x20 && c <= 0x7E); });
}

bool storable(const Entry& entry) noexcept {
  const std::uint16_t index = entry.address.index;
  return entry.access == Access::kReadWrite && entry.mappable == Mappable::kNo && index != 0x1003 &&
         index != 0x1010 && index != 0x1011;
}

bool within(const Entry& entry, std::uint16_t first, std::uint16_t last) noexcept {
  return entry.address.index >= first && entry.address.index <= last;
}

std::string place_name(std::uint16_t index, std::uint8_t sub) {
  return "object dictionary: entry " + std::to_string(index) + " sub " + std::to_string(sub);
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
    case DataType::kDomain:
      return text.size();
    default:
      return 4;
  }
}

std::span<const std::uint8_t> Entry::bytes() const noexcept {
  const void* value = number() ? static_cast<const void*>(&raw) : text.data();
  return {static_cast<const std::uint8_t*>(value), size()};
}

Entry& ObjectDictionary::insert(ObjectAddress address, DataType type, Access access, Mappable mappable) {
  const auto at = place(entries_, address);
  if (at != entries_.end() && (*at)->address == address) {
    throw std::runtime_error(place_name(address.index, address.sub) + " added twice, expected once");
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

void ObjectDictionary::add_string(std::uint16_t index, std::uint8_t sub, std::size_t longest) {
  if (longest > kLongestString) {
    throw std::runtime_error(place_name(index, sub) + " may be given " + std::to_string(longest) +
                             " bytes, expected at most " + std::to_string(kLongestString));
  }
  Entry& entry = insert({index, sub}, DataType::kVisibleString, Access::kReadWrite, Mappable::kNo);
  entry.longest = longest;
  entry.text.reserve(longest);
  entry.stored_text.reserve(longest);
}

void ObjectDictionary::add_domain(std::uint16_t index, std::uint8_t sub, std::string content) {
  insert({index, sub}, DataType::kDomain, Access::kReadOnly, Mappable::kNo);
  set_domain(index, sub, std::move(content));
}

void ObjectDictionary::set_domain(std::uint16_t index, std::uint8_t sub, std::string content) {
  Entry* entry = find(index, sub);
  if (entry == nullptr || entry->type != DataType::kDomain) {
    throw std::runtime_error(place_name(index, sub) + " is given a content, expected a domain");
  }
  if (content.size() > kLongestDomain) {
    throw std::runtime_error(place_name(index, sub) + " has " + std::to_string(content.size()) +
                             " bytes, expected at most " + std::to_string(kLongestDomain));
  }
  entry->text = std::move(content);
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
  if (!entry.number()) {
    if (bytes.size() > entry.longest) return SdoAbort::kTooLong;
    if (!visible(bytes)) return SdoAbort::kValue;
    // Within the capacity reserved; by pointer, since by iterators a temporary string would be made.
    entry.text.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return std::nullopt;
  }
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
  if (entry.type == DataType::kDomain && entry.text.empty()) return SdoAbort::kNoData;
  if (entry.read_hook) return entry.read_hook();
  return std::nullopt;
}

void ObjectDictionary::power_on(std::uint16_t first, std::uint16_t last) noexcept {
  for (const auto& entry : entries_) {
    if (!entry->writable() || !within(*entry, first, last)) continue;
    entry->raw = entry->stored ? entry->stored_raw : entry->default_raw;
    if (!entry->number()) entry->text = entry->stored ? entry->stored_text : entry->default_text;
  }
}

void ObjectDictionary::store(std::uint16_t first, std::uint16_t last) noexcept {
  for (const auto& entry : entries_) {
    if (!storable(*entry) || !within(*entry, first, last)) continue;
    // A value left at its factory setting goes on following it, as when the node-ID is changed.
    entry->stored = entry->number() ? entry->raw != entry->default_raw : entry->text != entry->default_text;
    entry->stored_raw = entry->raw;
    if (!entry->number()) entry->stored_text = entry->text;
  }
}

void ObjectDictionary::forget(std::uint16_t first, std::uint16_t last) noexcept {
  for (const auto& entry : entries_) {
    if (within(*entry, first, last)) entry->stored = false;
  }
}

void ObjectDictionary::shift_node_id(int difference) noexcept {
  for (const auto& entry : entries_) {
    if (!entry->plus_node_id) continue;
    entry->default_raw += static_cast<std::uint32_t>(difference);
    if (!entry->writable()) entry->raw = entry->default_raw;
  }
}

}  // namespace walkman::nodes
