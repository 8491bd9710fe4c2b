#pragma once

#include <array>
#include <optional>

#include "drivers/can/interface.h"

namespace walkman::robot {

/// Compares the nodes' time with the master's, on one bus: heartbeats that a node is set to produce at an
/// interval must be received at that interval. Nothing on the wire says how long an emulator assumes a cycle
/// to be, nor whether its clock follows SYNC or the host's: the interval shows the former, and whether
/// heartbeats arrive while the master withholds SYNC the latter.
///
/// Forwards everything to the wrapped interface; neither allocates nor throws.
class HeartbeatPace final : public can::Interface {
 public:
  /// From one node; the majority decides, so that a short disturbance has no effect.
  static constexpr std::size_t kIntervals = 9;

  /// `inner`, whose stamps are on the master's clock, must outlive this. `expected`: producer time to which
  /// the nodes are set (1017h); `tolerance`: how far the median of the received intervals may be from it.
  HeartbeatPace(can::Interface& inner, Time expected, Time tolerance) noexcept
      : inner_(&inner), expected_(expected), tolerance_(tolerance) {}

  /// The actual interval of the heartbeats, once it is known and if it is wrong.
  [[nodiscard]] std::optional<Time> wrong_interval() const noexcept;

  /// Heartbeats received from the observed node.
  [[nodiscard]] std::uint64_t heartbeats() const noexcept { return heartbeats_; }

  [[nodiscard]] can::SendResult send(const can::Frame& frame) noexcept override {
    return inner_->send(frame);
  }
  void flush() noexcept override { inner_->flush(); }
  [[nodiscard]] can::LinkState link() const noexcept override { return inner_->link(); }
  [[nodiscard]] bool receive(can::StampedFrame& out) noexcept override;
  [[nodiscard]] std::uint64_t receive_overflows() const noexcept override {
    return inner_->receive_overflows();
  }
  [[nodiscard]] std::string_view name() const noexcept override { return inner_->name(); }

 private:
  void observe(const can::StampedFrame& stamped) noexcept;

  can::Interface* inner_;
  Time expected_, tolerance_;
  std::uint32_t producer_ = 0;  // COB-ID of the observed node; 0: none yet
  Time last_ = Time::min();
  std::array<Time, kIntervals> intervals_{};
  std::size_t count_ = 0;
  std::uint64_t heartbeats_ = 0;
};

}  // namespace walkman::robot
