#include "emulator/datasheets/object_names.h"

#include <array>
#include <cctype>

#include <fmt/format.h>

#include "emulator/nodes/measuring/inertial_node.h"

namespace walkman::datasheets {
namespace {

constexpr std::uint16_t kSensorType = 0x6110;
constexpr std::uint16_t kPhysicalUnit = 0x6131;
constexpr std::string_view kChannel = "Channel {}";

std::string numbered(std::string_view text, int number) {
  const std::size_t at = text.find("{}");
  if (at == std::string_view::npos) return std::string(text);
  return fmt::format("{}{}{}", text.substr(0, at), number, text.substr(at + 2));
}

/// The table's row for a sub-index; null when there is none.
const SubName* find_sub(const ObjectName& object, std::uint8_t sub) {
  if (object.code == ObjectCode::kVariable || object.code == ObjectCode::kDomain) {
    return sub == 0 ? &object.self : nullptr;
  }
  if (sub == 0) return nullptr;
  if (!object.each.name.empty()) return &object.each;
  if (sub > object.subs.size() || object.subs[sub - 1U].name.empty()) return nullptr;
  return &object.subs[sub - 1U];
}

/// What a measuring channel is called after its sensor and unit: F, T, a or w and the axis of a triple, or a
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
  return numbered(kChannel, channel);
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

const ObjectName* find_object_name(std::uint16_t index) {
  for (const auto table : {communication_names(), manufacturer_names(), drive_names(), measuring_names()}) {
    for (const ObjectName& object : table) {
      if (object.first <= index && index <= object.last) return &object;
    }
  }
  return nullptr;
}

std::string object_name(std::uint16_t index) {
  const ObjectName* object = find_object_name(index);
  if (object == nullptr) return fmt::format("Object {:04X}h", index);
  return numbered(object->self.name, index - object->first + 1);
}

std::string entry_name(const nodes::ObjectDictionary& dictionary, nodes::ObjectAddress address) {
  const ObjectName* object = find_object_name(address.index);
  const SubName* sub = object == nullptr ? nullptr : find_sub(*object, address.sub);
  if (sub == nullptr) {
    if (address.sub == 0) return object == nullptr ? object_name(address.index) : std::string(object->count);
    return fmt::format("Sub-index {}", address.sub);
  }
  if (address.sub == 0) return object_name(address.index);
  if (sub->name == kChannel) return channel_name(dictionary, address.sub);
  return numbered(sub->name, address.sub);
}

std::string entry_symbol(const nodes::ObjectDictionary& dictionary, nodes::ObjectAddress address) {
  const ObjectName* object = find_object_name(address.index);
  const SubName* sub = object == nullptr ? nullptr : find_sub(*object, address.sub);
  if (sub == nullptr) return fmt::format("object_{:04X}_{}", address.index, address.sub);
  if (sub->name == kChannel) {
    const std::string_view stem = object->self.symbol;
    return fmt::format("{}_{}", stem.empty() ? lower(snake(object->self.name)) : std::string(stem),
                       snake(channel_name(dictionary, address.sub)));
  }
  if (!sub->symbol.empty()) return std::string(sub->symbol);
  if (address.sub == 0) return lower(snake(object_name(address.index)));
  return lower(snake(object_name(address.index) + ' ' + entry_name(dictionary, address)));
}

Quantity quantity_of(nodes::ObjectAddress address) {
  const ObjectName* object = find_object_name(address.index);
  const SubName* sub = object == nullptr ? nullptr : find_sub(*object, address.sub);
  return sub == nullptr ? Quantity::kPlain : sub->quantity;
}

bool is_named(nodes::ObjectAddress address) {
  const ObjectName* object = find_object_name(address.index);
  if (object == nullptr) return false;
  const bool simple = object->code == ObjectCode::kVariable || object->code == ObjectCode::kDomain;
  return find_sub(*object, address.sub) != nullptr || (address.sub == 0 && !simple);
}

}  // namespace walkman::datasheets
