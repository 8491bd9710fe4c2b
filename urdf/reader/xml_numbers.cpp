#include "urdf/reader/xml_numbers.h"

#include <charconv>
#include <cmath>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <tinyxml2.h>

namespace walkman {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";

std::string shown(std::string_view text) {
  constexpr std::size_t kLongest = 60;
  return text.size() <= kLongest ? std::string(text) : std::string(text.substr(0, kLongest)) + "...";
}

}  // namespace

std::optional<std::string> parse_numbers(std::string_view text, std::span<double> values) {
  std::string_view rest = text;
  std::size_t count = 0;
  while (true) {
    const std::size_t start = rest.find_first_not_of(kBlanks);
    if (start == std::string_view::npos) break;
    rest.remove_prefix(start);
    std::string_view word = rest.substr(0, rest.find_first_of(kBlanks));
    rest.remove_prefix(word.size());
    const std::string_view whole = word;
    if (word.front() == '+') word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc::result_out_of_range)
      return fmt::format("\"{}\" is outside the range of a number", shown(whole));
    if (error != std::errc() || end != word.data() + word.size())
      return fmt::format("\"{}\" is not a number", shown(whole));
    if (!std::isfinite(value)) return fmt::format("\"{}\" is not finite", shown(whole));
    if (count < values.size()) values[count] = value;
    ++count;
  }
  if (count != values.size())
    return fmt::format("\"{}\" has {} numbers, expected {}", shown(text), count, values.size());
  return std::nullopt;
}

std::optional<std::string> read_attribute(const tinyxml2::XMLElement& element, const char* attribute,
                                          std::span<double> values, bool required) {
  const char* text = element.Attribute(attribute);
  if (text == nullptr) {
    if (!required) return std::nullopt;
    return fmt::format("<{}> has no \"{}\"", element.Name(), attribute);
  }
  const auto wrong = parse_numbers(text, values);
  if (!wrong) return std::nullopt;
  return fmt::format("<{}> {}: {}", element.Name(), attribute, *wrong);
}

}  // namespace walkman
