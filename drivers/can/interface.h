#pragma once

#include <string_view>

#include "drivers/can/frame.h"

namespace walkman::can {

/// What became of a frame handed to an interface.
enum class SendResult {
  kQueued,         ///< accepted for transmission
  kQueueFull,      ///< transmit queue full (ENOBUFS on SocketCAN); may be tried again later
  kInterfaceDown,  ///< the interface is down or gone; nothing was queued
};

/// One end of one CAN bus, seen from a computer: a transmit and a receive queue.
///
/// There are two kinds: `SocketCan` (a network interface of the kernel) and the embedded bus's own end, which
/// the emulator hands out. Code above this type cannot tell them apart. Neither call blocks, allocates or
/// throws.
class Interface {
 public:
  virtual ~Interface() = default;

  [[nodiscard]] virtual SendResult send(const Frame& frame) noexcept = 0;

  /// Takes the oldest received frame. False when there is none.
  [[nodiscard]] virtual bool receive(StampedFrame& out) noexcept = 0;

  /// Frames lost because the receive queue was full, since the interface was opened.
  [[nodiscard]] virtual std::uint64_t receive_overflows() const noexcept = 0;

  [[nodiscard]] virtual std::string_view name() const noexcept = 0;
};

}  // namespace walkman::can
