#pragma once

#include <string>

#include "emulator/nodes/cia301/object_dictionary.h"

namespace walkman::datasheets {

/// Name of the object that `entry` belongs to, with its number if there are several of its kind.
[[nodiscard]] std::string object_name(const nodes::Entry& entry);

/// Name of an entry within its object; for a variable, the name of the object. Channels of a measuring device
/// are named after what they measure (Fx, Ty, ...), which is read from the dictionary.
[[nodiscard]] std::string entry_name(const nodes::ObjectDictionary& dictionary, const nodes::Entry& entry);

/// The entry's name for use in signal names: letters, digits, underscores.
[[nodiscard]] std::string entry_symbol(const nodes::ObjectDictionary& dictionary, const nodes::Entry& entry);

}  // namespace walkman::datasheets
