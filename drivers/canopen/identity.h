#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/canopen/sdo_sequence.h"

namespace walkman::canopen {

/// What 1000h and 1018h of a node must hold. What is not given is not compared; the vendor-ID must at least
/// not be 0.
struct ExpectedIdentity {
  std::uint32_t device_type = 0;          ///< 1000h
  std::optional<std::uint32_t> vendor;    ///< 1018h:1
  std::optional<std::uint32_t> product;   ///< 1018h:2
  std::optional<std::uint32_t> revision;  ///< 1018h:3
  std::optional<std::uint32_t> serial;    ///< 1018h:4
};

/// First steps of every node's configuration.
[[nodiscard]] std::vector<SdoStep> identity_steps(const ExpectedIdentity& identity);

}  // namespace walkman::canopen
