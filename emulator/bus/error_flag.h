#pragma once

#include "emulator/bus/wire_bits.h"

namespace walkman::bus {

inline constexpr int kErrorFlagBits = 6;
inline constexpr int kErrorDelimiterBits = 8;
/// Extra wait of an error-passive node after a frame of its own, before it sends again.
inline constexpr int kSuspendBits = 8;
/// Recessive bits that end a bus-off: so many runs of so many bits.
inline constexpr int kRecoveryRuns = 128;
inline constexpr int kRecoveryRunBits = 11;

/// Length of the error flag that starts after bit number `bit` of `wire`: 6 bits, superposed by the flags
/// that error-active others answer it with, 12 at most. They see an error at once in an unstuffed field, and
/// otherwise with the sixth equal bit, which counts the bits before the flag in. Whoever starts a flag goes
/// back to the nominal rate; others wait for their sixth bit at the rate they read the frame with.
///
/// `level`: what the bus showed at `bit`. `flag`: level of the first flag, recessive from an error-passive
/// node. `answered`: whether an error-active node other than the flag's sender is there.
[[nodiscard]] inline WireLength error_flag_length(const WireBits& wire, int bit, unsigned level,
                                                  unsigned flag, bool answered) noexcept {
  constexpr WireLength kSimultaneous{kErrorFlagBits, 0};
  if (!answered) return kSimultaneous;
  if (bit == wire.ack_slot()) return {flag == 0 ? kErrorFlagBits + 1 : kErrorFlagBits, 0};
  if (bit >= wire.ack_slot() - 1) return kSimultaneous;
  int run = 1;
  while (run < 6 && run <= bit && wire.level(bit - run) == level) ++run;
  if (run >= 6) return kSimultaneous;
  const int later = 6 - (level == flag ? run : 0);
  return wire.fast(bit) ? WireLength{kErrorFlagBits, later} : WireLength{kErrorFlagBits + later, 0};
}

}  // namespace walkman::bus
