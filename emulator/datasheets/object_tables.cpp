#include "emulator/datasheets/object_tables.h"

#include <algorithm>
#include <cctype>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>

#include "emulator/datasheets/eds_object.h"
#include "emulator/datasheets/object_names.h"
#include "emulator/nodes/cia301/communication_table.h"
#include "emulator/nodes/cia301/pdo_record.h"
#include "emulator/nodes/drive/drive_table.h"
#include "emulator/nodes/measuring/measuring_table.h"
#include "urdf/reader/text_file.h"

namespace walkman::datasheets {
namespace {

using nodes::Access;
using nodes::DataType;
using nodes::EntryRow;
using nodes::ObjectRow;
using nodes::Quantity;

constexpr std::size_t kMostBytes = 16'000'000;  // of a document
constexpr std::string_view kBegin = "<!-- generated: ";
constexpr std::string_view kClose = " -->";
constexpr std::string_view kEnd = "<!-- end -->";

std::string_view type_word(DataType type) {
  switch (type) {
    case DataType::kInteger8:
      return "i8";
    case DataType::kInteger16:
      return "i16";
    case DataType::kInteger32:
      return "i32";
    case DataType::kUnsigned8:
      return "u8";
    case DataType::kUnsigned16:
      return "u16";
    case DataType::kUnsigned32:
      return "u32";
    case DataType::kReal32:
      return "real32";
    case DataType::kVisibleString:
      return "string";
    case DataType::kDomain:
      return "domain";
  }
  return "";
}

std::string_view unit_word(Quantity quantity) {
  switch (quantity) {
    case Quantity::kPlain:
      return "";
    case Quantity::kPosition:
      return "µrad";
    case Quantity::kVelocity:
      return "µrad/s";
    case Quantity::kAcceleration:
      return "µrad/s²";
    case Quantity::kTorquePerMille:
      return "‰ of 6076h";
    case Quantity::kCurrentPerMille:
      return "‰ of 6075h";
    case Quantity::kMilliNewtonMetre:
      return "mN·m";
    case Quantity::kMilliAmpere:
      return "mA";
    case Quantity::kMilliVolt:
      return "mV";
    case Quantity::kMilliSecond:
      return "ms";
    case Quantity::kMicroSecond:
      return "µs";
    case Quantity::kHundredMicroSeconds:
      return "100 µs";
    case Quantity::kDeciCelsius:
      return "0.1 °C";
    case Quantity::kCelsius:
      return "°C";
    case Quantity::kStiffness:
      return "mN·m/rad";
    case Quantity::kDamping:
      return "mN·m·s/rad";
    case Quantity::kCoarseStiffness:
      return "0.1 N·m/rad";
    case Quantity::kCoarseDamping:
      return "0.01 N·m·s/rad";
    case Quantity::kTorqueSlope:
      return "‰ of 6076h per second";
    case Quantity::kMeasuredReal:
      return "unit of 6131h";
    case Quantity::kMeasuredInteger:
      return "unit of 6131h, digits of 6132h";
  }
  return "";
}

std::string factory_text(std::uint16_t index, const EntryRow& row) {
  const bool number = row.type != DataType::kVisibleString && row.type != DataType::kDomain;
  const bool process_data = row.access == Access::kReadOnly && row.mappable == nodes::Mappable::kYes;
  if (!number || row.access == Access::kWriteOnly || (process_data && !row.own)) return "";
  if (row.own) return "of the device";
  if (row.with_node_id) return fmt::format("{:X}h + id", row.factory);
  if (row.type == DataType::kReal32) return fmt::format("{:g}", nodes::from_raw<float>(row.factory));
  if (!is_hexadecimal(index, row.type)) return number_text(index, row.type, row.factory);
  return row.factory > 9 ? fmt::format("{:X}h", row.factory) : fmt::format("{}", row.factory);
}

std::string joined(std::initializer_list<std::string_view> parts) {
  std::string text;
  for (const std::string_view part : parts) {
    if (part.empty()) continue;
    text += (text.empty() ? "" : "; ") + std::string(part);
  }
  return text;
}

std::string name_of(std::string_view name) {
  std::string text(name);
  for (const std::string_view placeholder : {" {}", "{} "}) {
    const std::size_t at = text.find(placeholder);
    if (at != std::string::npos) text.erase(at, placeholder.size());
  }
  return text;
}

void append_entry(std::string& text, const ObjectRow& object, const EntryRow& row, const std::string& sub,
                  bool first) {
  std::string address = fmt::format("{:04X}", object.index);
  if (object.objects > 1) address += fmt::format("–{:04X}", object.index + object.objects - 1);
  std::string name = name_of(object.name);
  const bool named = !object.simple() && row.name != nodes::kChannelName && name_of(row.name) != name;
  if (named) name = first ? name + ": " + name_of(row.name) : name_of(row.name);
  constexpr std::string_view kAccess[] = {"ro", "wo", "rw", "const"};
  text += fmt::format("| {}{} | {} | {} {}{} | {} | {} |\n", address, sub.empty() ? "" : ":" + sub, name,
                      type_word(row.type), kAccess[static_cast<std::size_t>(row.access)],
                      row.mappable == nodes::Mappable::kYes ? " *" : "", factory_text(object.index, row),
                      joined({unit_word(row.quantity), row.meaning, first ? object.meaning : ""}));
}

std::string table_of(std::initializer_list<nodes::ObjectTable> tables) {
  std::vector<const ObjectRow*> objects;
  for (const nodes::ObjectTable table : tables)
    for (const ObjectRow& object : table) objects.push_back(&object);
  std::stable_sort(objects.begin(), objects.end(),
                   [](const ObjectRow* a, const ObjectRow* b) { return a->index < b->index; });
  std::string text =
      "| object | name | type, access | factory setting | unit; meaning |\n|---|---|---|---|---|\n";
  for (const ObjectRow* object : objects) {
    bool first = true;
    const auto append = [&](const EntryRow& row, const std::string& sub) {
      append_entry(text, *object, row, sub, first);
      first = false;
    };
    if (object->simple() || object->zero.access != Access::kConst)
      append(object->zero, object->simple() ? "" : "0");
    if (!object->each.name.empty()) {
      append(object->each, object->each_count == 0 ? "1–n" : fmt::format("1–{}", object->each_count));
    }
    for (std::size_t i = 0; i < object->entries.size(); ++i)
      if (!object->entries[i].name.empty()) append(object->entries[i], fmt::format("{}", i + 1));
  }
  return text;
}

/// "6040 controlword (16)" for each object that a PDO maps.
std::string content_text(const nodes::ObjectDictionary& dictionary, std::uint16_t mapping) {
  std::string text;
  const std::uint32_t count = dictionary.find(mapping, 0)->raw;
  for (std::uint32_t n = 1; n <= count; ++n) {
    const std::uint32_t mapped = dictionary.find(mapping, static_cast<std::uint8_t>(n))->raw;
    const nodes::Entry* entry = dictionary.find(static_cast<std::uint16_t>(mapped >> 16U),
                                                static_cast<std::uint8_t>(mapped >> 8U & 0xFFU));
    if (entry == nullptr) continue;
    std::string name = entry_name(dictionary, *entry);
    if (name.size() > 2) name[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(name[0])));
    const std::string sub = entry->address.sub == 0 ? "" : fmt::format(":{}", entry->address.sub);
    text += fmt::format("{}{:04X}{} {} ({})", text.empty() ? "" : ", ", entry->address.index, sub, name,
                        mapped & 0xFFU);
  }
  return text.empty() ? "—" : text;
}

std::string pdo_table(const WiredDevice& device) {
  const nodes::ObjectDictionary& d = device.node->dictionary();
  std::string text = "| PDO | COB-ID | type | content (bits) |\n|---|---|---|---|\n";
  struct Direction {
    char word;
    int communication, mapping;
  };
  for (const Direction& direction : {Direction{'R', 0x1400, 0x1600}, Direction{'T', 0x1800, 0x1A00}}) {
    for (int i = 0; d.find(static_cast<std::uint16_t>(direction.communication + i), 1) != nullptr; ++i) {
      const auto value = [&](std::uint8_t sub) {
        return d.find(static_cast<std::uint16_t>(direction.communication + i), sub)->default_raw;
      };
      const bool off = (value(1) & nodes::kCobIdInvalid) != 0;
      text += fmt::format("| {}PDO{} | {:X}h + id | {}{}{} | {} |\n", direction.word, i + 1,
                          (value(1) & nodes::kCobIdMask) - device.node->node_id(), value(2),
                          off ? ", off" : "", value(5) == 0 ? "" : fmt::format(", {} ms", value(5)),
                          content_text(d, static_cast<std::uint16_t>(direction.mapping + i)));
    }
  }
  return text;
}

std::string generated(const std::string& name, const std::vector<WiredBus>& buses) {
  if (name == "objects of every node") return table_of({nodes::communication_table()});
  if (name == "objects of a drive") return table_of({nodes::drive_table()});
  if (name == "objects of a measuring device") {
    return table_of({nodes::channel_table(), nodes::digits_table(), nodes::adjustment_table(),
                     nodes::sensor_temperature_table(), nodes::sample_counter_table()});
  }
  constexpr std::string_view kPdosOf = "PDOs of ";
  if (name.starts_with(kPdosOf)) {
    for (const WiredBus& bus : buses)
      for (const WiredDevice& device : bus.devices)
        if (type_name(device.device->kind) == name.substr(kPdosOf.size())) return pdo_table(device);
  }
  throw std::runtime_error(
      "generated table '" + name +
      "', expected 'objects of every node', 'objects of a drive', 'objects of a measuring "
      "device' or 'PDOs of' a kind of device");
}

}  // namespace

std::string with_object_tables(const std::string& document, const std::vector<WiredBus>& buses) {
  std::istringstream lines(document);
  std::string text, line;
  while (std::getline(lines, line)) {
    text += line + '\n';
    if (!line.starts_with(kBegin) || !line.ends_with(kClose)) continue;
    const std::string name = line.substr(kBegin.size(), line.size() - kBegin.size() - kClose.size());
    text += generated(name, buses);
    while (line != kEnd) {
      if (!std::getline(lines, line))
        throw std::runtime_error("generated table '" + name + "' has no line " + std::string(kEnd));
    }
    text += line + '\n';
  }
  return text;
}

std::vector<std::filesystem::path> update_object_tables(const std::vector<WiredBus>& buses,
                                                        const std::filesystem::path& file) {
  const std::string before = read_text_file(file, kMostBytes);
  try {
    write_file(file, with_object_tables(before, buses));
  } catch (const std::runtime_error& e) {
    throw std::runtime_error(file.string() + ": " + e.what());
  }
  return {file};
}

}  // namespace walkman::datasheets
