#pragma once

#include <string>

#include "emulator/nodes/cia301/object_dictionary.h"

namespace walkman::datasheets {

/// Name of the object that `entry` belongs to, with its number where there are several of the kind.
[[nodiscard]] std::string object_name(const nodes::Entry& entry);

/// Name of one entry, as it is told within its object; that of the object for a variable. Channels of a
/// measuring device are called after what they measure (Fx, Ty, ...), which the dictionary tells.
[[nodiscard]] std::string entry_name(const nodes::ObjectDictionary& dictionary, const nodes::Entry& entry);

/// Word for the entry in signal names: letters, digits, underscores.
[[nodiscard]] std::string entry_symbol(const nodes::ObjectDictionary& dictionary, const nodes::Entry& entry);

}  // namespace walkman::datasheets
