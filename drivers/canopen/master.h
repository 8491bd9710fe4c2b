#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "drivers/can/interface.h"
#include "drivers/canopen/bus_traffic.h"
#include "drivers/canopen/cob_id.h"

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
    std::uint64_t reports = 0;   ///< of those received: reports of the own controller, no frames of the bus
  };

  /// `interface` must outlive the master. `rates`: of the bus, for the bus time of what is received;
  /// `heartbeat_period`: of the master's own heartbeat (77Fh); `sync_overflow`: 2 to 240, SYNC carries a
  /// counter that goes up to it (1019h), or 0, it has none.
  Master(can::Interface& interface, const can::BitRates& rates, Time heartbeat_period,
         std::uint8_t sync_overflow = 0) noexcept
      : interface_(&interface),
        heartbeat_period_(heartbeat_period),
        sync_overflow_(sync_overflow),
        traffic_(rates) {}

  /// `node` must outlive the master.
  void add(RemoteNode& node) noexcept;

  /// Hands everything received to its node.
  void receive(Time now) noexcept;

  /// Drops everything received.
  void discard() noexcept;

  /// `node` 0 means all. False when the interface did not take it.
  [[nodiscard]] bool nmt(NmtCommand command, std::uint8_t node = 0) noexcept;

  /// SYNC (CiA 301, 7.2.5). False when the interface did not take it.
  bool sync() noexcept;
  /// The next SYNC has the counter 1.
  void restart_sync_counter() noexcept { sync_counter_ = 0; }

  /// The master's own heartbeat, when its period has passed.
  void heartbeat(Time now) noexcept;

  /// SDO requests that are waiting, one per node.
  void send_requests() noexcept;

  /// False when the interface did not take it.
  bool send(const can::Frame& frame) noexcept;

  /// Hands the cycle's frames over and judges what became of them; to be called after the last one.
  void end_cycle(Time now) noexcept;

  /// The controller's state at the end of the last cycle; kDown too when a frame was refused for that.
  [[nodiscard]] can::LinkState link() const noexcept { return link_; }
  /// The link can carry nothing: down, gone or bus-off.
  [[nodiscard]] bool link_lost() const noexcept {
    return link_ == can::LinkState::kDown || link_ == can::LinkState::kBusOff;
  }
  /// The interface refused a frame of the last cycle because it can never carry it.
  [[nodiscard]] bool frame_refused() const noexcept { return invalid_; }
  /// Frames lost in receive queues since `forget_overflows`.
  [[nodiscard]] std::uint64_t new_overflows() const noexcept {
    return interface_->receive_overflows() - overflows_seen_;
  }
  void forget_overflows() noexcept { overflows_seen_ = interface_->receive_overflows(); }
  /// Consecutive cycles in which the interface refused a frame because its queue was full.
  [[nodiscard]] int full_cycles() const noexcept { return full_cycles_; }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  [[nodiscard]] const BusTraffic& traffic() const noexcept { return traffic_; }
  /// COB-IDs of frames that only a master sends and this one did not, in the order in which they were first
  /// received; the first eight.
  [[nodiscard]] std::span<const std::uint32_t> foreign_ids() const noexcept {
    return std::span(foreign_).first(foreign_count_);
  }
  [[nodiscard]] can::Interface& interface() const noexcept { return *interface_; }

 private:
  static constexpr std::size_t kForeignIds = 8;

  void note_foreign(std::uint32_t id) noexcept;

  can::Interface* interface_;
  Time heartbeat_period_;
  std::array<RemoteNode*, 128> nodes_{};
  Time heartbeat_sent_ = Time::min();
  std::uint8_t sync_overflow_;
  std::uint8_t sync_counter_ = 0;
  bool refused_down_ = false;
  bool refused_full_ = false;
  bool refused_invalid_ = false;
  bool invalid_ = false;
  can::LinkState link_ = can::LinkState::kActive;
  std::uint64_t overflows_seen_ = 0;
  int full_cycles_ = 0;
  Counters counters_;
  BusTraffic traffic_;
  std::array<std::uint32_t, kForeignIds> foreign_{};
  std::size_t foreign_count_ = 0;
};

}  // namespace walkman::canopen
