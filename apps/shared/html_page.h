#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace walkman::apps {

/// Begin of a page with all that it needs in itself; `style`: of what no other page has. `kPageEnd` ends it.
[[nodiscard]] std::string page_head(std::string_view title, std::string_view style);
inline constexpr const char* kPageEnd = "</body></html>\n";

/// Text as it may stand between tags and in quoted attributes.
[[nodiscard]] std::string escaped(std::string_view text);

/// Begin of a table with a row of headings, which may hold tags.
[[nodiscard]] std::string table_head(const std::vector<std::string>& headings);

}  // namespace walkman::apps
