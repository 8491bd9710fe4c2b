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

/// Whether all are characters of a VISIBLE_STRING (CiA 301, table 44).
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

std::string place_name(ObjectAddress address) {
  return "object dictionary: entry " + std::to_string(address.index) + " sub " + std::to_string(address.sub);
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

void ObjectDictionary::insert(ObjectAddress address, const ObjectRow& object, const EntryRow& row) {
  const auto at = place(entries_, address);
  if (at != entries_.end() && (*at)->address == address) {
    throw std::runtime_error(place_name(address) + " added twice, expected once");
  }
  if (row.longest > kLongestString) {
    throw std::runtime_error(place_name(address) + " allows " + std::to_string(row.longest) +
                             " bytes, expected at most " + std::to_string(kLongestString));
  }
  auto entry = std::make_unique<Entry>(values_.emplace_back(0));
  entry->address = address;
  entry->object = &object;
  entry->row = &row;
  entry->type = row.type;
  entry->access = row.access;
  entry->mappable = row.mappable;
  entry->plus_node_id = row.with_node_id;
  entry->raw = entry->default_raw = row.factory + (row.with_node_id ? node_id_ : 0U);
  entry->lowest = row.lowest;
  entry->highest = row.highest;
  entry->allowed = row.allowed;
  entry->longest = row.longest;
  entry->text.reserve(row.longest);
  entry->stored_text.reserve(row.longest);
  entries_.insert(at, std::move(entry));
}

void ObjectDictionary::add(const ObjectRow& table_row, std::uint8_t count) {
  const ObjectRow& row = rows_.emplace_back(table_row);
  const std::size_t subs = row.each.name.empty() ? row.entries.size() : count;
  for (std::uint16_t i = 0; i < row.objects; ++i) {
    const auto index = static_cast<std::uint16_t>(row.index + i);
    insert({index, 0}, row, row.zero);
    if (row.simple()) continue;
    if (row.zero.access == Access::kConst)
      find(index, 0)->raw = find(index, 0)->default_raw = static_cast<std::uint8_t>(subs);
    for (std::size_t sub = 1; sub <= subs; ++sub) {
      const EntryRow* entry = row.find(static_cast<std::uint8_t>(sub));
      if (entry != nullptr) insert({index, static_cast<std::uint8_t>(sub)}, row, *entry);
    }
  }
}

void ObjectDictionary::add(ObjectTable table) {
  for (const ObjectRow& row : table) add(row);
}

void ObjectDictionary::extend(std::uint16_t index) {
  const Entry* first = find(index, 0);
  if (first == nullptr || first->object->each.name.empty()) {
    throw std::runtime_error(place_name({index, 0}) +
                             " cannot be extended, expected an object whose entries are all alike");
  }
  std::uint8_t sub = 1;
  while (find(index, sub) != nullptr) ++sub;
  insert({index, sub}, *first->object, first->object->each);
}

Entry& ObjectDictionary::typed(ObjectAddress address, DataType type) {
  Entry* entry = find(address.index, address.sub);
  if (entry == nullptr || entry->type != type) {
    throw std::runtime_error(place_name(address) +
                             " is missing or of another type, expected the type that the device uses");
  }
  return *entry;
}

void ObjectDictionary::set_text(std::uint16_t index, std::string text) {
  typed({index, 0}, DataType::kVisibleString).text = std::move(text);
}

void ObjectDictionary::set_domain(std::uint16_t index, std::string content) {
  Entry& entry = typed({index, 0}, DataType::kDomain);
  if (content.size() > kLongestDomain) {
    throw std::runtime_error(place_name(entry.address) + " has " + std::to_string(content.size()) +
                             " bytes, expected at most " + std::to_string(kLongestDomain));
  }
  entry.text = std::move(content);
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

Refusal ObjectDictionary::write(Entry& entry, std::span<const std::uint8_t> bytes) noexcept {
  if (!entry.writable()) return SdoAbort::kReadOnly;
  if (!entry.number()) {
    if (bytes.size() > entry.longest) return SdoAbort::kTooLong;
    if (!visible(bytes)) return SdoAbort::kValue;
    // Fits into the reserved capacity; by pointer, because iterators would create a temporary string.
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
    if (entry.allowed != 0 && (entry.allowed >> static_cast<unsigned>(value) & 1U) == 0)
      return SdoAbort::kValue;
  }
  if (entry.write_hook) {
    if (const Refusal refused = entry.write_hook(raw)) return refused;
  }
  entry.raw = raw;
  return std::nullopt;
}

Refusal ObjectDictionary::read(const Entry& entry) const noexcept {
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
    // A value left at its factory setting continues to follow it, for example when the node-ID changes.
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
