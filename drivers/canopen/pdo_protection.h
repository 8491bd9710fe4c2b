#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/can/frame.h"

namespace walkman::canopen {

/// 2052h, mapped as the last object of a PDO, protects that PDO: its low byte counts the transmissions, its
/// high byte is the CRC-8 of AUTOSAR's end-to-end profile 2 (polynomial 2Fh, init and final XOR FFh) over
/// COB-ID (16 bits), the objects before it and that count. It detects every error of up to three bits in a
/// frame of 8 bytes; of random frames, one in 256 passes.

/// Fills in the protection. `bytes`: size of all mapped objects, without a CAN FD frame's padding.
void protect(can::Frame& frame, std::size_t bytes, std::uint8_t count) noexcept;

/// Checks the protected PDOs of one kind from one sender.
class PdoGuard {
 public:
  enum class Verdict {
    kNew,
    kCorrupt,   ///< the CRC does not match: bits have changed, or it is a different PDO
    kRepeated,  ///< the count equals the last one or one of the few before it: an old frame
  };
  /// Judges the next frame, which has at least `bytes` bytes; `bytes` as for `protect`. Hot.
  [[nodiscard]] Verdict judge(const can::Frame& frame, std::size_t bytes) noexcept;
  /// Call when the sender restarts.
  void restart() noexcept { last_.reset(); }

 private:
  std::optional<std::uint8_t> last_;
};

}  // namespace walkman::canopen
