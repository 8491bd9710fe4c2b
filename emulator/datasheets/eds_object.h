#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "emulator/datasheets/object_names.h"
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

/// The lines of one object (CiA 306): section [IIII], and [IIIIsubS] for each sub-index of an array or
/// record. `devices` are of one type. A default or limit that is not the same in all of them is left out; a
/// COB-ID that contains the node-ID is told with $NODEID. So are defaults of process data left out, which
/// have none. Throws std::runtime_error when a device lacks an entry the first one has.
void append_object(std::vector<std::string>& lines, const ObjectEntries& object,
                   std::span<const EdsDevice> devices);

/// CiA 301 data type index; REAL32 values are written as their bits, because Lely's reader takes only those.
[[nodiscard]] std::uint16_t data_type_code(nodes::DataType type);

}  // namespace walkman::datasheets
