#include "emulator/datasheets/eds_object.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>

#include "emulator/datasheets/object_names.h"

namespace walkman::datasheets {
namespace {

using nodes::Access;
using nodes::DataType;
using nodes::Entry;
using nodes::ObjectCode;

struct Range {
  std::int64_t lowest = 0;
  std::int64_t highest = 0;
  bool operator==(const Range&) const = default;
};

template <typename T>
constexpr Range range_of_type() {
  return {+std::numeric_limits<T>::min(), +std::numeric_limits<T>::max()};
}

/// Nothing for non-integer types.
std::optional<Range> type_range(DataType type) {
  switch (type) {
    case DataType::kInteger8:
      return range_of_type<std::int8_t>();
    case DataType::kInteger16:
      return range_of_type<std::int16_t>();
    case DataType::kInteger32:
      return range_of_type<std::int32_t>();
    case DataType::kUnsigned8:
      return range_of_type<std::uint8_t>();
    case DataType::kUnsigned16:
      return range_of_type<std::uint16_t>();
    case DataType::kUnsigned32:
      return range_of_type<std::uint32_t>();
    default:
      return std::nullopt;
  }
}

std::string_view access_word(Access access) {
  switch (access) {
    case Access::kReadOnly:
      return "ro";
    case Access::kWriteOnly:
      return "wo";
    case Access::kReadWrite:
      return "rw";
    case Access::kConst:
      return "const";
  }
  return "";
}

const Entry& same_entry(const Entry& entry, const EdsDevice& device) {
  const Entry* found = device.dictionary->find(entry.address.index, entry.address.sub);
  if (found == nullptr || found->type != entry.type || found->access != entry.access ||
      found->mappable != entry.mappable) {
    throw std::runtime_error(
        fmt::format("device with node-ID {}: object {:04X}h sub {} is missing or of another kind, expected "
                    "as in the other "
                    "devices of its type",
                    device.node_id, entry.address.index, entry.address.sub));
  }
  return *found;
}

bool has_default(const Entry& entry) {
  // A value that the device computes when it is read has no default either.
  const bool computed = entry.access == Access::kReadOnly && entry.read_hook;
  // One EDS reader expects the bits, one decimals, and one rejects the file for either.
  if (entry.type == DataType::kReal32) return false;
  const bool serial_number = entry.address == nodes::ObjectAddress{0x1018, 4};
  const bool process_data = entry.access == Access::kReadOnly && entry.mappable == nodes::Mappable::kYes;
  return entry.access != Access::kWriteOnly && !process_data && !computed && !serial_number;
}

/// Nothing if the devices differ.
std::optional<std::string> default_text(const Entry& entry, std::span<const EdsDevice> devices) {
  if (!has_default(entry)) return std::nullopt;
  const auto all = [&](auto predicate) {
    return std::all_of(devices.begin(), devices.end(),
                       [&](const EdsDevice& device) { return predicate(device, same_entry(entry, device)); });
  };
  if (entry.type == DataType::kDomain) return std::nullopt;
  if (entry.type == DataType::kVisibleString) {
    if (!all([&](const EdsDevice&, const Entry& other) { return other.text == entry.text; }))
      return std::nullopt;
    return entry.text;
  }
  const std::uint32_t base = entry.default_raw - devices.front().node_id;
  if (entry.plus_node_id && all([&](const EdsDevice& device, const Entry& other) {
        return other.default_raw - device.node_id == base;
      })) {
    return fmt::format("$NODEID+0x{:X}", base);
  }
  if (!all([&](const EdsDevice&, const Entry& other) { return other.default_raw == entry.default_raw; }))
    return std::nullopt;
  return number_text(entry.address.index, entry.type, entry.default_raw);
}

void append_limits(std::vector<std::string>& lines, const Entry& entry, std::span<const EdsDevice> devices) {
  const std::optional<Range> widest = type_range(entry.type);
  if (!widest || !entry.writable()) return;
  const auto same = [&](auto member) {
    return std::all_of(devices.begin(), devices.end(), [&](const EdsDevice& device) {
      return same_entry(entry, device).*member == entry.*member;
    });
  };
  if (entry.lowest > widest->lowest && same(&Entry::lowest))
    lines.push_back(fmt::format("LowLimit={}", entry.lowest));
  if (entry.highest < widest->highest && same(&Entry::highest))
    lines.push_back(fmt::format("HighLimit={}", entry.highest));
}

void append_value(std::vector<std::string>& lines, const Entry& entry, ObjectCode code,
                  std::span<const EdsDevice> devices) {
  for (const EdsDevice& device : devices) static_cast<void>(same_entry(entry, device));
  lines.push_back("ParameterName=" + entry_name(*devices.front().dictionary, entry));
  lines.push_back(fmt::format("ObjectType=0x{:X}", static_cast<unsigned>(code)));
  lines.push_back(fmt::format("DataType=0x{:04X}", data_type_code(entry.type)));
  append_limits(lines, entry, devices);
  lines.push_back(fmt::format("AccessType={}", access_word(entry.access)));
  if (const auto value = default_text(entry, devices)) lines.push_back("DefaultValue=" + *value);
  lines.push_back(fmt::format("PDOMapping={}", entry.mappable == nodes::Mappable::kYes ? 1 : 0));
}

}  // namespace

bool is_hexadecimal(std::uint16_t index, DataType type) {
  if (type == DataType::kReal32) return true;
  if (type != DataType::kUnsigned32) return false;
  return index < 0x2000 || index == 0x6131 || index == 0x6502 || (index >= 0x60A8 && index <= 0x60AA);
}

std::string number_text(std::uint16_t index, DataType type, std::uint32_t raw) {
  if (is_hexadecimal(index, type)) return fmt::format("0x{:08X}", raw);
  switch (type) {
    case DataType::kInteger8:
      return fmt::format("{}", static_cast<int>(nodes::from_raw<std::int8_t>(raw)));
    case DataType::kInteger16:
      return fmt::format("{}", nodes::from_raw<std::int16_t>(raw));
    case DataType::kInteger32:
      return fmt::format("{}", nodes::from_raw<std::int32_t>(raw));
    default:
      return fmt::format("{}", raw);
  }
}

std::uint16_t data_type_code(DataType type) {
  switch (type) {
    case DataType::kInteger8:
      return 0x0002;
    case DataType::kInteger16:
      return 0x0003;
    case DataType::kInteger32:
      return 0x0004;
    case DataType::kUnsigned8:
      return 0x0005;
    case DataType::kUnsigned16:
      return 0x0006;
    case DataType::kUnsigned32:
      return 0x0007;
    case DataType::kReal32:
      return 0x0008;
    case DataType::kVisibleString:
      return 0x0009;
    case DataType::kDomain:
      return 0x000F;
  }
  throw std::runtime_error(fmt::format("data type {}: not known to the EDS writer", static_cast<int>(type)));
}

std::vector<ObjectEntries> objects_of(const nodes::ObjectDictionary& dictionary) {
  std::vector<ObjectEntries> objects;
  for (const auto& entry : dictionary.entries()) {
    if (objects.empty() || objects.back().index != entry->address.index)
      objects.push_back({entry->address.index, {}});
    objects.back().entries.push_back(entry.get());
  }
  return objects;
}

void append_object(std::vector<std::string>& lines, const ObjectEntries& object,
                   std::span<const EdsDevice> devices) {
  const ObjectCode code = object.entries.front()->object->code;
  lines.push_back(fmt::format("[{:04X}]", object.index));
  if (code == ObjectCode::kVariable || code == ObjectCode::kDomain) {
    append_value(lines, *object.entries.front(), code, devices);
    lines.emplace_back();
    return;
  }
  lines.push_back("ParameterName=" + object_name(*object.entries.front()));
  lines.push_back(fmt::format("ObjectType=0x{:X}", static_cast<unsigned>(code)));
  lines.push_back(fmt::format("SubNumber={}", object.entries.size()));
  lines.emplace_back();
  for (const Entry* entry : object.entries) {
    lines.push_back(fmt::format("[{:04X}sub{:X}]", object.index, entry->address.sub));
    append_value(lines, *entry, ObjectCode::kVariable, devices);
    lines.emplace_back();
  }
}

}  // namespace walkman::datasheets
