#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace walkman::apps {

/// Beginning of a self-contained page; `style`: rules that no other page has. `kPageEnd` ends it.
[[nodiscard]] std::string page_head(std::string_view title, std::string_view style);
inline constexpr const char* kPageEnd = "</body></html>\n";

/// Escapes text for use between tags and in quoted attributes.
[[nodiscard]] std::string escaped(std::string_view text);

/// Beginning of a table with a row of headings, which may contain tags.
[[nodiscard]] std::string table_head(const std::vector<std::string>& headings);

}  // namespace walkman::apps
