#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "emulator/nodes/cia301/object_dictionary.h"

namespace walkman::datasheets {

/// A device of a bus.
struct DbcDevice {
  std::string name;
  std::uint8_t node_id = 0;
  std::string description;  ///< one line
  const nodes::ObjectDictionary* dictionary = nullptr;
};

/// The CAN database of one bus: a message for each PDO that a device maps, with signals in SI units, and the
/// other services with their raw fields. ASCII, decimal numbers without exponents. Signals that carry an
/// object have the attributes ObjectIndex and ObjectSub.
[[nodiscard]] std::string dbc_text(const std::string& bus, const std::vector<DbcDevice>& devices);

}  // namespace walkman::datasheets
