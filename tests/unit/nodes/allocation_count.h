#pragma once

namespace walkman::nodes {

/// Returns the number of calls of operator new in this program so far.
[[nodiscard]] long allocation_count() noexcept;

}  // namespace walkman::nodes
