#pragma once

#include <array>
#include <cstdint>

#include "drivers/can/interface.h"
#include "drivers/canopen/nmt.h"

namespace walkman::canopen {

class RemoteNode;

/// The NMT, SYNC and SDO master of one bus: shares one interface between the bus's nodes.
/// Apart from `add`, nothing in it allocates or throws.
class Master {
 public:
  struct Counters {
    std::uint64_t received = 0;  ///< frames taken from the interface
    std::uint64_t ignored = 0;   ///< of those: from nobody known, or of wrong kind or length
    std::uint64_t foreign = 0;   ///< of those: frames that only a master sends
    std::uint64_t not_sent = 0;  ///< frames the interface did not take
  };

  /// `interface` must outlive the master.
  Master(can::Interface& interface, Time heartbeat_period) noexcept
      : interface_(&interface), heartbeat_period_(heartbeat_period) {}

  /// `node` must outlive the master.
  void add(RemoteNode& node) noexcept;

  /// Hands everything received to its node.
  void receive(Time now) noexcept;

  /// Drops everything received.
  void discard() noexcept;

  /// `node` 0 means all. False when the interface did not take it.
  [[nodiscard]] bool nmt(NmtCommand command, std::uint8_t node = 0) noexcept;

  /// SYNC without counter (CiA 301, 7.2.5).
  bool sync() noexcept;

  /// The master's own heartbeat, when its period has passed.
  void heartbeat(Time now) noexcept;

  /// SDO requests that are waiting, one a node.
  void send_requests() noexcept;

  bool send(const can::Frame& frame) noexcept;

  /// Judges what became of the cycle's frames; to be called after the last one.
  void end_cycle() noexcept;

  /// The interface refused a frame of the last cycle because it is down.
  [[nodiscard]] bool interface_down() const noexcept { return down_; }
  /// Consecutive cycles in which the interface refused a frame because its queue was full.
  [[nodiscard]] int full_cycles() const noexcept { return full_cycles_; }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  [[nodiscard]] can::Interface& interface() const noexcept { return *interface_; }

 private:
  can::Interface* interface_;
  Time heartbeat_period_;
  std::array<RemoteNode*, 128> nodes_{};
  Time heartbeat_sent_ = Time::min();
  bool refused_down_ = false;
  bool refused_full_ = false;
  bool down_ = false;
  int full_cycles_ = 0;
  Counters counters_;
};

}  // namespace walkman::canopen
