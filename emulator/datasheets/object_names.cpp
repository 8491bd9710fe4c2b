#include "emulator/datasheets/object_names.h"

#include <array>
#include <cctype>

#include <fmt/format.h>

#include "emulator/datasheets/wire_unit.h"
#include "emulator/nodes/measuring/inertial_node.h"
#include "emulator/nodes/measuring/measuring_table.h"

namespace walkman::datasheets {
namespace {

constexpr std::uint16_t kSensorType = 0x6110;
constexpr std::uint16_t kPhysicalUnit = 0x6131;

std::string numbered(std::string_view text, int number) {
  const std::size_t at = text.find("{}");
  if (at == std::string_view::npos) return std::string(text);
  return fmt::format("{}{}{}", text.substr(0, at), number, text.substr(at + 2));
}

/// Name of a measuring channel, from its sensor and unit: F, T, a or w and the axis of a triple, or a
/// component of a quaternion.
std::string channel_name(const nodes::ObjectDictionary& dictionary, std::uint8_t channel) {
  const auto sensor = [&](int number) {
    const nodes::Entry* entry = dictionary.find(kSensorType, static_cast<std::uint8_t>(number));
    return entry == nullptr ? 0U : entry->default_raw;
  };
  if (sensor(channel) == nodes::kOrientationSensor) {
    int first = channel;
    while (sensor(first - 1) == nodes::kOrientationSensor) --first;
    return {'q', "wxyz"[(channel - first) % 4]};
  }
  const nodes::Entry* unit = dictionary.find(kPhysicalUnit, channel);
  const std::string text = unit == nullptr ? "" : unit_of_code(unit->default_raw).text;
  constexpr std::array<std::pair<std::string_view, char>, 5> kLetters{
      {{"N", 'F'}, {"Nm", 'T'}, {"N/kg", 'a'}, {"m/s^2", 'a'}, {"rad/s", 'w'}}};
  for (const auto& [name, letter] : kLetters) {
    if (text == name) return {letter, "xyz"[(channel - 1) % 3]};
  }
  return numbered(nodes::kChannelName, channel);
}

std::string snake(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      out.push_back(c);
    } else if (!out.empty() && out.back() != '_') {
      out.push_back('_');
    }
  }
  if (!out.empty() && out.back() == '_') out.pop_back();
  return out;
}

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

}  // namespace

std::string object_name(const nodes::Entry& entry) {
  return numbered(entry.object->name, entry.address.index - entry.object->index + 1);
}

std::string entry_name(const nodes::ObjectDictionary& dictionary, const nodes::Entry& entry) {
  if (entry.object->simple()) return object_name(entry);
  if (entry.address.sub == 0) return std::string(entry.row->name);
  if (entry.row->name == nodes::kChannelName) return channel_name(dictionary, entry.address.sub);
  return numbered(entry.row->name, entry.address.sub);
}

std::string entry_symbol(const nodes::ObjectDictionary& dictionary, const nodes::Entry& entry) {
  if (entry.row->name == nodes::kChannelName) {
    const std::string_view stem = entry.object->zero.symbol;
    return fmt::format("{}_{}", stem.empty() ? lower(snake(entry.object->name)) : std::string(stem),
                       snake(channel_name(dictionary, entry.address.sub)));
  }
  if (!entry.row->symbol.empty()) return std::string(entry.row->symbol);
  if (entry.object->simple()) return lower(snake(object_name(entry)));
  return lower(snake(object_name(entry) + ' ' + entry_name(dictionary, entry)));
}

}  // namespace walkman::datasheets
