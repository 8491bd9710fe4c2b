#pragma once

#include <cmath>
#include <cstddef>

#include "emulator/faults/fault_plan.h"
#include "tests/fuzz/input.h"

namespace walkman::fuzz {

/// Requires the properties of every fault that a reader of plans accepts.
inline void require_in_range(const faults::Injection& injection) {
  require(injection.kind != nullptr && injection.values.size() == injection.kind->parameters.size(),
          "a fault has a kind and its parameters");
  for (std::size_t i = 0; i < injection.values.size(); ++i) {
    const faults::Parameter& parameter = injection.kind->parameters[i];
    require(injection.values[i] >= parameter.least && injection.values[i] <= parameter.most,
            "a parameter is in its range");
  }
  require(injection.at >= 0 && std::isfinite(injection.at), "a fault begins at some time");
  require(!injection.lasts || *injection.lasts > 0, "a fault lasts");
  require(!injection.every || (injection.lasts && *injection.every >= *injection.lasts),
          "a fault is over before it comes again");
}

}  // namespace walkman::fuzz
