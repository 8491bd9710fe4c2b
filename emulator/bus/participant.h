#pragma once

#include <cstdint>

#include "drivers/can/interface.h"

namespace walkman::bus {

/// Something with a CAN controller on an emulated bus. It has no socket and no clock: frames and time are
/// passed in, frames to send are taken out. No member allocates or throws.
class Participant {
 public:
  Participant() = default;
  virtual ~Participant() = default;
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  /// Takes a frame of another participant that was complete on the bus at `now`.
  virtual void receive(const can::Frame& frame, Time now) noexcept = 0;

  /// Runs every timer that is due at or before `now`. Time never goes back.
  virtual void advance(Time now) noexcept = 0;

  /// When `advance` must be called next; Time::max() if no timer runs. A time in the past means at once.
  [[nodiscard]] virtual Time next_event() const noexcept = 0;

  /// The frame it would send next, or null. Its contents may change until `take`.
  [[nodiscard]] virtual const can::Frame* pending() const noexcept = 0;

  /// Called when the frame shown by `pending` has won arbitration and is on the wire now. The controller
  /// keeps it until it has been sent.
  virtual void take() noexcept = 0;

  /// Called when its controller has entered another state (ISO 11898-1, fault confinement). In bus-off the
  /// bus neither takes frames from it nor delivers any to it.
  virtual void on_link_state(can::LinkState /*state*/, Time /*now*/) noexcept {}

  /// Whether its frames are sent only once, instead of again after an error or without an acknowledgement.
  [[nodiscard]] virtual bool one_shot() const noexcept { return false; }

  /// Called in bus-off: whether its controller is to return to the bus, which then takes 128 times 11
  /// recessive bits. A device restarts by itself.
  [[nodiscard]] virtual bool restarts() const noexcept { return true; }

  /// Number of frames it could not queue for transmission.
  [[nodiscard]] virtual std::uint64_t transmit_overflows() const noexcept = 0;
};

}  // namespace walkman::bus
