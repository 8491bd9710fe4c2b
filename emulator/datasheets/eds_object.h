#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "emulator/nodes/cia301/object_dictionary.h"

namespace walkman::datasheets {

/// One device whose dictionary goes into an EDS.
struct EdsDevice {
  std::uint8_t node_id = 0;
  const nodes::ObjectDictionary* dictionary = nullptr;
};

/// Sub-indices of one object in the dictionary, in order.
struct ObjectEntries {
  std::uint16_t index = 0;
  std::vector<const nodes::Entry*> entries;
};

[[nodiscard]] std::vector<ObjectEntries> objects_of(const nodes::ObjectDictionary& dictionary);

/// Appends the lines of one object (CiA 306): section [IIII], and [IIIIsubS] for each sub-index of an array
/// or record. `devices` are of one type. A default or limit that differs between them is omitted; a COB-ID
/// that contains the node-ID is written with $NODEID. Defaults are also omitted for process data, which have
/// none, and for REAL32 values, for which readers expect different forms. Throws std::runtime_error if a
/// device lacks an entry that the first one has.
void append_object(std::vector<std::string>& lines, const ObjectEntries& object,
                   std::span<const EdsDevice> devices);

/// Whether a value of this type is more readable in hexadecimal: bit fields, codes, identifiers.
[[nodiscard]] bool is_hexadecimal(std::uint16_t index, nodes::DataType type);

/// Formats a number of up to 32 bits as in an EDS.
[[nodiscard]] std::string number_text(std::uint16_t index, nodes::DataType type, std::uint32_t raw);

/// CiA 301 data type index.
[[nodiscard]] std::uint16_t data_type_code(nodes::DataType type);

}  // namespace walkman::datasheets
