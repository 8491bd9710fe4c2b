#pragma once

namespace walkman::nodes {

/// Calls of operator new in this program so far.
[[nodiscard]] long allocation_count() noexcept;

}  // namespace walkman::nodes
