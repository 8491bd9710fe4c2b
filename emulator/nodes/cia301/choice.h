#pragma once

#include <algorithm>
#include <cstdint>
#include <initializer_list>

#include "emulator/nodes/cia301/object_dictionary.h"

namespace walkman::nodes {

/// Limits an option to some of the numbers 0..63; another one within their range is refused with 0609 0030.
template <typename T>
void allow(Object<T>& option, std::initializer_list<T> values) {
  std::uint64_t allowed = 0;
  for (const T value : values) allowed |= std::uint64_t{1} << static_cast<unsigned>(value);
  option.limits(std::min(values), std::max(values)).on_write([allowed](T value) -> Verdict {
    if ((allowed >> static_cast<unsigned>(value) & 1U) == 0) return SdoAbort::kValue;
    return std::nullopt;
  });
}

}  // namespace walkman::nodes
