#pragma once

#include <cstdint>

#include "drivers/can/frame.h"
#include "drivers/time.h"

namespace walkman::bus {

/// Detects SYNC cycles that do not fit on the bus.
///
/// A cycle overruns if from one SYNC to the next there was no instant at which the bus was free for cyclic
/// traffic: neither idle nor left to SDO, error control or LSS (identifiers from 580h on), which come after
/// every PDO. The cycle's traffic then ran into the next SYNC, or was delayed by it.
class SyncWatch {
 public:
  /// Notes that a frame starts on the bus and will be sent successfully.
  void frame(const can::Frame& frame, Time now) noexcept {
    if (frame.id == kSync && !frame.extended && !frame.remote) {
      if (in_cycle_ && !free_) ++overruns_;
      in_cycle_ = true;
      free_ = false;
      started_ = now;
    } else if (frame.extended || frame.id >= kFirstAcyclic) {
      free_for_more(now);
    }
  }
  /// Notes that nobody has anything to send.
  void idle(Time now) noexcept { free_for_more(now); }

  [[nodiscard]] std::uint64_t overruns() const noexcept { return overruns_; }
  /// Longest time from the start of a SYNC until the bus was free.
  [[nodiscard]] Time longest() const noexcept { return longest_; }

 private:
  static constexpr std::uint32_t kSync = 0x080;
  static constexpr std::uint32_t kFirstAcyclic = 0x580;

  void free_for_more(Time now) noexcept {
    if (free_) return;
    free_ = true;
    if (in_cycle_ && now - started_ > longest_) longest_ = now - started_;
  }

  bool in_cycle_ = false;
  bool free_ = true;
  Time started_{};
  Time longest_{};
  std::uint64_t overruns_ = 0;
};

}  // namespace walkman::bus
