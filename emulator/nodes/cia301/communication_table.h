#pragma once

#include <cstdint>

#include "emulator/nodes/cia301/object_dictionary.h"
#include "emulator/nodes/cia301/object_table.h"

namespace walkman::nodes {

/// The objects that every device has: CiA 301, 7.5, NMT start-up 1F80h (CiA 302-2), and the manufacturer's
/// 2060h, 2061h.
[[nodiscard]] ObjectTable communication_table();

inline constexpr std::uint16_t kUserNote = 0x2060;
inline constexpr std::uint16_t kNodeClock = 0x2061;

inline constexpr std::uint32_t kCobIdInvalid = 0x80000000U;   ///< bit 31: object does not exist
inline constexpr std::uint32_t kCobIdNoRtr = 0x40000000U;     ///< bit 30 of a TPDO: no remote request
inline constexpr std::uint32_t kCobIdExtended = 0x20000000U;  ///< bit 29: 29-bit identifier
inline constexpr std::uint32_t kCobIdMask = 0x7FFU;

/// Whether SYNC, EMCY and PDOs must not use a CAN identifier (CiA 301, table 38).
[[nodiscard]] constexpr bool restricted_identifier(std::uint32_t id) noexcept {
  return id <= 0x07F || (id >= 0x101 && id <= 0x180) || (id >= 0x581 && id <= 0x5FF) ||
         (id >= 0x601 && id <= 0x67F) || (id >= 0x6E0 && id <= 0x6FF) || (id >= 0x701 && id <= 0x77F) ||
         id >= 0x780;
}

/// Checks a write to a COB-ID entry: only base identifiers and the flags in `allowed_flags`, no restricted
/// identifier, and no other identifier while the object stays valid. Refuses with 0609 0030.
[[nodiscard]] inline Refusal check_cob_id(std::uint32_t value, std::uint32_t present,
                                          std::uint32_t allowed_flags) noexcept {
  if ((value & ~(allowed_flags | kCobIdMask)) != 0) return SdoAbort::kValue;
  if ((value & kCobIdInvalid) != 0) return std::nullopt;
  if (restricted_identifier(value & kCobIdMask)) return SdoAbort::kValue;
  const bool stays_valid = (present & kCobIdInvalid) == 0;
  if (stays_valid && (value & kCobIdMask) != (present & kCobIdMask)) return SdoAbort::kValue;
  return std::nullopt;
}

}  // namespace walkman::nodes
