#include "drivers/robot/yaml_numbers.h"

#include <charconv>
#include <system_error>

#include <fmt/format.h>

namespace walkman::robot {

std::uint32_t read_hexadecimal(const YamlMap& map, const std::string& key, std::uint32_t min,
                               std::uint32_t max) {
  const std::string text = map.text(key);
  std::uint32_t value = 0;
  const bool prefix = text.size() > 2 && text[0] == '0' && (text[1] == 'x' || text[1] == 'X');
  const char* begin = text.data() + (prefix ? 2 : 0);
  const auto [end, error] = std::from_chars(begin, text.data() + text.size(), value, 16);
  if (!prefix || error != std::errc() || end != text.data() + text.size() || value < min || value > max) {
    map.fail(key,
             fmt::format("found \"{}\", expected a hexadecimal number of 0x{:X} to 0x{:X}", text, min, max));
  }
  return value;
}

}  // namespace walkman::robot
