#pragma once

#include <cstdint>

#include "drivers/can/interface.h"

namespace walkman::bus {

/// Something with a CAN controller on an emulated bus. It holds no socket and no clock: frames and time are
/// pushed in, frames to send are taken out. No member allocates or throws.
class Participant {
 public:
  Participant() = default;
  virtual ~Participant() = default;
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  /// A frame of another participant was complete on the bus at `now`.
  virtual void receive(const can::Frame& frame, Time now) noexcept = 0;

  /// Lets every timer run that is due at or before `now`. Time never goes back.
  virtual void advance(Time now) noexcept = 0;

  /// When `advance` has to be called next; Time::max() when no timer runs. A time in the past means at once.
  [[nodiscard]] virtual Time next_event() const noexcept = 0;

  /// The frame it would send next, or null. Its contents may change until `take`.
  [[nodiscard]] virtual const can::Frame* pending() const noexcept = 0;

  /// The frame `pending` shows has won arbitration and is on the wire now. Its controller keeps it until it
  /// is through.
  virtual void take() noexcept = 0;

  /// Its controller has come into another state (ISO 11898-1, fault confinement). In bus-off the bus neither
  /// takes frames from it nor gives it any.
  virtual void on_link_state(can::LinkState /*state*/, Time /*now*/) noexcept {}

  /// Whether its frames are sent once only, instead of again after an error or without an acknowledgement.
  [[nodiscard]] virtual bool one_shot() const noexcept { return false; }

  /// Asked in bus-off: whether its controller is to come back on the bus, which then takes 128 times 11
  /// recessive bits. A device restarts itself.
  [[nodiscard]] virtual bool restarts() const noexcept { return true; }

  /// Frames it could not queue for transmission.
  [[nodiscard]] virtual std::uint64_t transmit_overflows() const noexcept = 0;
};

}  // namespace walkman::bus
