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
/// Neither allocates nor throws, except in `add`.
class Master {
 public:
  struct Counters {
    std::uint64_t received = 0;  ///< frames taken from the interface
    std::uint64_t ignored = 0;   ///< of those: unknown sender, wrong kind or wrong length
    std::uint64_t foreign = 0;   ///< of those: frames that only a master sends
    std::uint64_t not_sent = 0;  ///< frames the interface did not accept
    std::uint64_t reports = 0;   ///< of those received: reports of this computer's controller, not bus frames
  };

  /// `interface` must outlive the master. `rates`: bit rates of the bus, for the bus time of received frames;
  /// `heartbeat_period`: of the master's own heartbeat (77Fh); `sync_overflow`: 2 to 240: SYNC carries a
  /// counter up to this value (1019h); 0: SYNC has no counter.
  Master(can::Interface& interface, const can::BitRates& rates, Time heartbeat_period,
         std::uint8_t sync_overflow = 0) noexcept
      : interface_(&interface),
        heartbeat_period_(heartbeat_period),
        sync_overflow_(sync_overflow),
        traffic_(rates) {}

  /// `node` must outlive the master.
  void add(RemoteNode& node) noexcept;

  /// Passes all received frames to their nodes.
  void receive(Time now) noexcept;

  /// Discards all received frames.
  void discard() noexcept;

  /// Sends an NMT command; `node` 0 means all. Returns false if the interface did not accept it.
  [[nodiscard]] bool nmt(NmtCommand command, std::uint8_t node = 0) noexcept;

  /// Sends SYNC (CiA 301, 7.2.5). Returns false if the interface did not accept it.
  bool sync() noexcept;
  /// Makes the next SYNC carry the counter 1.
  void restart_sync_counter() noexcept { sync_counter_ = 0; }

  /// Sends the master's own heartbeat if its period has elapsed.
  void heartbeat(Time now) noexcept;

  /// Sends pending SDO requests, one per node.
  void send_requests() noexcept;

  /// Returns false if the interface did not accept the frame.
  bool send(const can::Frame& frame) noexcept;

  /// Hands the cycle's frames over and evaluates the result; call after the last frame.
  void end_cycle(Time now) noexcept;

  /// The controller's state at the end of the last cycle; also kDown if a frame was refused for that reason.
  [[nodiscard]] can::LinkState link() const noexcept { return link_; }
  /// Whether the link cannot carry anything: down, gone or bus-off.
  [[nodiscard]] bool link_lost() const noexcept {
    return link_ == can::LinkState::kDown || link_ == can::LinkState::kBusOff;
  }
  /// Whether the interface refused a frame of the last cycle because it can never carry it.
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
  /// COB-IDs of frames that only a master sends and this one did not, in order of first reception; the first
  /// eight.
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
