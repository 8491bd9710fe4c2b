#pragma once

#include "drivers/can/frame.h"
#include "emulator/bus/fault_confinement.h"
#include "emulator/bus/wire_bits.h"

namespace walkman::bus {

/// An error on the bus as a controller saw it.
struct BusError {
  enum class Kind { kBit, kStuff, kForm, kNoAcknowledge };
  Kind kind = Kind::kBit;
  bool sending = false;  ///< in its own frame
  unsigned level = 0;    ///< kBit of a sender: what the bus showed instead of the bit it sent
  FrameField field = FrameField::kStartOfFrame;
};

/// Error frames as SocketCAN reports them (linux/can/error.h), 8 bytes, the counters in bytes 6 (transmit)
/// and 7 (receive).

/// Class "protocol violation, bus error"; if the acknowledgement is missing, that class as well.
[[nodiscard]] can::Frame bus_error_message(const BusError& error,
                                           const FaultConfinement& controller) noexcept;

/// The state that has just been entered: class "controller" with warning, passive or active again for the
/// higher counter; or class "bus-off".
[[nodiscard]] can::Frame state_message(const FaultConfinement& controller) noexcept;

/// Class "restarted": bus-off is over.
[[nodiscard]] can::Frame restart_message() noexcept;

}  // namespace walkman::bus
