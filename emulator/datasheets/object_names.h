#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "emulator/datasheets/wire_unit.h"
#include "emulator/nodes/cia301/object_dictionary.h"

namespace walkman::datasheets {

/// Object codes of CiA 301, table 42.
enum class ObjectCode : std::uint8_t { kDomain = 2, kVariable = 7, kArray = 8, kRecord = 9 };

/// One sub-index: its name, its unit, and a short word for signal names (at most 15 characters; empty: made
/// from the names).
struct SubName {
  std::string_view name = {};
  Quantity quantity = Quantity::kPlain;
  std::string_view symbol = {};
};

/// The objects first..last, which differ by a number only: "{}" in `name` is replaced by 1 for the first.
struct ObjectName {
  std::uint16_t first = 0;
  std::uint16_t last = 0;
  ObjectCode code = ObjectCode::kVariable;
  SubName self = {};  ///< of the object; of its value where it is a variable
  /// Sub-index 1, 2, ...; where `each` is set, every sub-index from 1 on is called that, "{}" replaced by it.
  std::vector<SubName> subs = {};
  SubName each = {};
  std::string_view count = "Highest sub-index supported";  ///< sub-index 0
};

/// Objects of CiA 301, of CiA 402, of CiA 404, and of the manufacturer area 2xxxh, each by index.
[[nodiscard]] std::span<const ObjectName> communication_names();
[[nodiscard]] std::span<const ObjectName> drive_names();
[[nodiscard]] std::span<const ObjectName> measuring_names();
[[nodiscard]] std::span<const ObjectName> manufacturer_names();

/// Null when the tables do not have it.
[[nodiscard]] const ObjectName* find_object_name(std::uint16_t index);

/// Name of an object; "Object 5FFFh" for one the tables do not have.
[[nodiscard]] std::string object_name(std::uint16_t index);

/// Name of one entry, as it is told within its object; that of the object for a variable. Channels of a
/// measuring device are called after what they measure (Fx, Ty, ...), which the dictionary tells.
[[nodiscard]] std::string entry_name(const nodes::ObjectDictionary& dictionary, nodes::ObjectAddress address);

/// Word for the entry in signal names: letters, digits, underscores.
[[nodiscard]] std::string entry_symbol(const nodes::ObjectDictionary& dictionary,
                                       nodes::ObjectAddress address);

[[nodiscard]] Quantity quantity_of(nodes::ObjectAddress address);

/// Whether the tables name the entry.
[[nodiscard]] bool is_named(nodes::ObjectAddress address);

}  // namespace walkman::datasheets
