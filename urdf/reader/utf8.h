#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace walkman {

/// Place of the first byte that is not well-formed UTF-8 (RFC 3629: no overlong forms, no surrogates, at most
/// U+10FFFF), or nothing.
[[nodiscard]] std::optional<std::size_t> first_non_utf8(std::string_view text);

/// The text with all that a terminal would act on made visible as \xNN or \uNNNN: control characters (line
/// feeds and tabs stay), those that turn the direction of writing, and bytes that are not UTF-8.
[[nodiscard]] std::string printable(std::string_view text);

/// The same for a sentence: a line feed, carriage return or tab in it is made visible too.
[[nodiscard]] std::string one_line(std::string_view text);

}  // namespace walkman
