#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace tinyxml2 {
class XMLElement;
}

namespace walkman {

/// Reads `values.size()` finite numbers separated by blanks. Returns what is wrong with the text, or nullopt.
[[nodiscard]] std::optional<std::string> parse_numbers(std::string_view text, std::span<double> values);

/// The same for an attribute. A missing one is an error if `required`, otherwise leaves `values` unchanged.
[[nodiscard]] std::optional<std::string> read_attribute(const tinyxml2::XMLElement& element,
                                                        const char* attribute, std::span<double> values,
                                                        bool required);

}  // namespace walkman
