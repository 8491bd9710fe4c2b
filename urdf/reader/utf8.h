#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace walkman {

/// Position of the first byte that is not well-formed UTF-8 (RFC 3629: no overlong forms, no surrogates, at
/// most U+10FFFF), or nullopt.
[[nodiscard]] std::optional<std::size_t> first_non_utf8(std::string_view text);

/// Returns the text with everything that a terminal would act on made visible as \xNN or \uNNNN: control
/// characters (line feeds and tabs are kept), characters that change the writing direction, and bytes that
/// are not UTF-8.
[[nodiscard]] std::string printable(std::string_view text);

/// The same for a sentence: line feeds, carriage returns and tabs are made visible, too.
[[nodiscard]] std::string one_line(std::string_view text);

}  // namespace walkman
