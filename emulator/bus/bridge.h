#pragma once

#include <cstdint>

#include "drivers/can/interface.h"
#include "emulator/bus/can_bus.h"

namespace walkman::bus {

struct BridgeCounters {
  std::uint64_t entered = 0;  ///< frames from outside that the bus took
  std::uint64_t handed = 0;   ///< frames of the bus that the outside took
  std::uint64_t refused =
      0;  ///< frames from outside that the bus cannot carry, or whose transmit queue was full
  std::uint64_t undelivered = 0;  ///< frames of the bus lost because the outside was down
};

/// Plugs a network interface of the kernel into an emulated bus: what programs send there is sent by the
/// computer's controller, what that controller receives or reports (error frames) is what they see. Holds no
/// clock and waits for nothing; the caller decides when frames pass.
class Bridge {
 public:
  /// Both must outlive the bridge. `outside` has to let every frame in, not only those for a master.
  Bridge(CanBus& bus, can::Interface& outside) noexcept : bus_(&bus), outside_(&outside) {}

  /// The oldest frame that has arrived from outside; false when there is none. Error frames are passed over:
  /// they tell of a controller that is not this bus's.
  [[nodiscard]] bool receive(can::Frame& out) noexcept;

  /// Puts a frame from outside into the computer's transmit queue, from the bus's `now` on.
  void enter(const can::Frame& frame) noexcept;

  /// Hands everything the computer's controller has received to the outside, in one batch. False when the
  /// outside's queue is full and frames remain: to be called again later, nothing is lost.
  bool hand_out() noexcept;

  [[nodiscard]] CanBus& bus() const noexcept { return *bus_; }
  [[nodiscard]] can::Interface& outside() const noexcept { return *outside_; }
  [[nodiscard]] const BridgeCounters& counters() const noexcept { return counters_; }

 private:
  CanBus* bus_;
  can::Interface* outside_;
  can::StampedFrame held_;  // what the outside's queue had no room for
  bool holding_ = false;
  BridgeCounters counters_;
};

}  // namespace walkman::bus
