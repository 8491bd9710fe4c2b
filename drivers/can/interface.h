#pragma once

#include <string_view>

#include "drivers/can/frame.h"

namespace walkman::can {

/// What became of a frame handed to an interface.
enum class SendResult {
  kQueued,         ///< accepted for transmission
  kQueueFull,      ///< transmit queue full (ENOBUFS on SocketCAN); may be tried again later
  kInterfaceDown,  ///< the interface is down, gone or in bus-off; nothing was queued
  kInvalid,        ///< no frame this interface can carry (EINVAL on SocketCAN); trying again is of no use
};

/// What the CAN controller behind an interface is able to do (ISO 11898-1, fault confinement).
enum class LinkState {
  kActive,   ///< error-active
  kWarning,  ///< error-active, an error counter at 96 or more
  kPassive,  ///< error-passive: an error counter at 128 or more
  kBusOff,   ///< transmit error counter above 255; sends and receives nothing until restarted
  kDown,     ///< the interface is down or gone
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

  /// Hands frames that `send` has gathered to the controller. An end that gathers nothing does nothing here.
  virtual void flush() noexcept {}

  /// As far as it is known: a virtual interface of the kernel has no controller and is always error-active.
  [[nodiscard]] virtual LinkState link() const noexcept { return LinkState::kActive; }

  /// Takes the oldest received frame. False when there is none.
  [[nodiscard]] virtual bool receive(StampedFrame& out) noexcept = 0;

  /// Frames lost because the receive queue was full, since the interface was opened.
  [[nodiscard]] virtual std::uint64_t receive_overflows() const noexcept = 0;

  [[nodiscard]] virtual std::string_view name() const noexcept = 0;
};

}  // namespace walkman::can
