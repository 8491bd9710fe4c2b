#pragma once

#include <cstdint>
#include <string>

#include "emulator/nodes/cia301/object_dictionary.h"

namespace walkman::datasheets {

/// A value in SI (degC for temperatures) is `raw * factor` in `text`, which is ASCII; empty for no unit.
struct WireUnit {
  std::string text;
  double factor = 1;
};

/// The unit of an entry of a device. Rated values, units and decimal digits that it depends on are read from
/// the device's dictionary; if they are missing, the value has no unit.
[[nodiscard]] WireUnit wire_unit(const nodes::ObjectDictionary& dictionary, const nodes::Entry& entry);

/// Name of a CiA 303-2 unit code (prefix exponent, numerator, denominator) and the factor of its prefix; an
/// empty text for an unknown code.
[[nodiscard]] WireUnit unit_of_code(std::uint32_t code);

}  // namespace walkman::datasheets
