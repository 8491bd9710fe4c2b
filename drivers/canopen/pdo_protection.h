#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/can/frame.h"

namespace walkman::canopen {

/// Mapped as the last object of a PDO, 2052h makes it a protected one: its low byte counts the transmissions,
/// its high byte is the CRC-8 of AUTOSAR's end-to-end profile 2 (polynomial 2Fh, init and final XOR FFh) over
/// COB-ID (16 bits), the objects before it and that count. It detects every error of up to three bits in
/// a frame of 8 bytes; of random frames, one in 256 passes.

/// Fills the protection in. `bytes`: of all mapped objects, without a CAN FD frame's padding.
void protect(can::Frame& frame, std::size_t bytes, std::uint8_t count) noexcept;

/// What is to be thought of the protected PDOs of one kind that come from one sender.
class PdoGuard {
 public:
  enum class Verdict {
    kNew,
    kCorrupt,   ///< the CRC does not fit: bits have changed, or it is another PDO
    kRepeated,  ///< the count is the last one's, or one of the few before it: an old frame
  };
  /// Of the next frame, with at least `bytes` bytes; `bytes` as for `protect`. Hot.
  [[nodiscard]] Verdict judge(const can::Frame& frame, std::size_t bytes) noexcept;
  /// The sender begins anew.
  void restart() noexcept { last_.reset(); }

 private:
  std::optional<std::uint8_t> last_;
};

}  // namespace walkman::canopen
