#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace walkman {

/// The candidate with the fewest edits (insert, delete, replace, swap of neighbours) from `name`, for "did
/// you mean"; empty if even that one differs by more than a third of its letters, or two for short names. The
/// first among equals.
[[nodiscard]] std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates);

/// `; did you mean "X"?` or nothing.
[[nodiscard]] std::string did_you_mean(std::string_view name, const std::vector<std::string>& candidates);

}  // namespace walkman
