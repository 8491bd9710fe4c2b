#pragma once

#include <string_view>

#include "drivers/can/frame.h"

namespace walkman::can {

/// Result of handing a frame to an interface.
enum class SendResult {
  kQueued,         ///< accepted for transmission
  kQueueFull,      ///< transmit queue full (ENOBUFS on SocketCAN); may be retried later
  kInterfaceDown,  ///< the interface is down, gone or in bus-off; nothing was queued
  kInvalid,        ///< not a frame this interface can carry (EINVAL on SocketCAN); retrying is pointless
};

/// State of the CAN controller behind an interface (ISO 11898-1, fault confinement).
enum class LinkState {
  kActive,   ///< error-active
  kWarning,  ///< error-active, an error counter at 96 or more
  kPassive,  ///< error-passive: an error counter at 128 or more
  kBusOff,   ///< transmit error counter above 255; sends and receives nothing until restarted
  kDown,     ///< the interface is down or gone
};

/// Human-readable name: "error-active", "error-passive", "bus-off" and so on.
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
/// There are two kinds: `SocketCan` (a network interface of the kernel) and the one provided by the embedded
/// bus. Code above this type cannot tell them apart. No call blocks, allocates or throws.
class Interface {
 public:
  virtual ~Interface() = default;

  /// Queues one frame; returns the immediate result.
  [[nodiscard]] virtual SendResult send(const Frame& frame) noexcept = 0;

  /// Hands the frames collected by `send` to the controller. Does nothing on an interface that does not
  /// collect frames.
  virtual void flush() noexcept {}

  /// Link state as far as it is known: a virtual interface of the kernel has no controller and is always
  /// error-active.
  [[nodiscard]] virtual LinkState link() const noexcept { return LinkState::kActive; }

  /// Takes the oldest received frame. Returns false if there is none.
  [[nodiscard]] virtual bool receive(StampedFrame& out) noexcept = 0;

  /// Frames lost because the receive queue was full, since the interface was opened.
  [[nodiscard]] virtual std::uint64_t receive_overflows() const noexcept = 0;

  /// Name of the interface for display, e.g. "can_rarm".
  [[nodiscard]] virtual std::string_view name() const noexcept = 0;
};

}  // namespace walkman::can
