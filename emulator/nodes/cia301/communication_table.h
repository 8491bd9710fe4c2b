#pragma once

#include "emulator/nodes/cia301/object_table.h"

namespace walkman::nodes {

/// The objects every device has: CiA 301, 7.5, NMT start-up 1F80h (CiA 302-2), and 2060h, 2061h of the manufacturer.
[[nodiscard]] ObjectTable communication_table();

inline constexpr std::uint16_t kUserNote = 0x2060;
inline constexpr std::uint16_t kNodeClock = 0x2061;

}  // namespace walkman::nodes
