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

/// The name for people: "error-active", "error-passive", "bus-off" and so on.
[[nodiscard]] constexpr std::string_view name_of(LinkState state) noexcept {
  switch (state) {
    case LinkState::kActive:
      return "error-active";
    case LinkState::kWarning:
      return "error-warning";
    case LinkState::kPassive:
      return "error-passive";
    case LinkState::kBusOff:
      return "bus-off";
    case LinkState::kDown:
      return "down";
  }
  return "unknown";
}

/// A computer's connection to one CAN bus: a transmit and a receive queue.
///
/// There are two kinds: `SocketCan` (a network interface of the kernel) and the one the embedded bus hands
/// out. Code above this type cannot tell them apart. No call blocks, allocates or throws.
class Interface {
 public:
  virtual ~Interface() = default;

  /// Queues one frame; what became of it at once.
  [[nodiscard]] virtual SendResult send(const Frame& frame) noexcept = 0;

  /// Hands frames that `send` has gathered to the controller. An interface that gathers nothing does nothing
  /// here.
  virtual void flush() noexcept {}

  /// As far as it is known: a virtual interface of the kernel has no controller and is always error-active.
  [[nodiscard]] virtual LinkState link() const noexcept { return LinkState::kActive; }

  /// Takes the oldest received frame. False when there is none.
  [[nodiscard]] virtual bool receive(StampedFrame& out) noexcept = 0;

  /// Frames lost because the receive queue was full, since the interface was opened.
  [[nodiscard]] virtual std::uint64_t receive_overflows() const noexcept = 0;

  /// Name of the interface for texts, e.g. "can_rarm".
  [[nodiscard]] virtual std::string_view name() const noexcept = 0;
};

}  // namespace walkman::can
