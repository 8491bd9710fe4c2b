#pragma once

#include <array>
#include <optional>

#include "drivers/can/interface.h"

namespace walkman::robot {

/// Compares the nodes' time with the master's, on one bus: heartbeats that a node is set to produce at an
/// interval have to be received at that interval. Nothing on the wire says how long an emulator takes a cycle
/// for, nor whether its clock follows SYNC or the host's: the interval shows the one, and whether heartbeats
/// come while the master holds SYNC back the other.
///
/// Passes everything on to the interface inside; neither allocates nor throws.
class HeartbeatPace final : public can::Interface {
 public:
  /// Of one node; what most of them say counts, so that a short disturbance does not.
  static constexpr std::size_t kIntervals = 9;

  /// `inner`, whose stamps are on the master's clock, must outlive this. `expected`: producer time that the
  /// nodes are set to (1017h); `tolerance`: how far the median of the received intervals may be from it.
  HeartbeatPace(can::Interface& inner, Time expected, Time tolerance) noexcept
      : inner_(&inner), expected_(expected), tolerance_(tolerance) {}

  /// The interval that heartbeats have, once it is known and is not what it should be.
  [[nodiscard]] std::optional<Time> wrong_interval() const noexcept;

  /// Heartbeats received from the node that is observed.
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
  std::uint32_t producer_ = 0;  // COB-ID of the node that is observed; 0: none yet
  Time last_ = Time::min();
  std::array<Time, kIntervals> intervals_{};
  std::size_t count_ = 0;
  std::uint64_t heartbeats_ = 0;
};

}  // namespace walkman::robot
