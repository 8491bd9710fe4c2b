#pragma once

#include <array>
#include <cstdint>

#include "drivers/can/frame.h"
#include "drivers/can/frame_time.h"

namespace walkman::canopen {

/// Traffic of one bus over the last few cycles as seen by this computer: how much of it is foreign, that is
/// unsolicited, and the identifier that most of the foreign frames carry. Does not allocate.
class BusTraffic {
 public:
  /// Foreign traffic of the last `kCycles` cycles.
  struct Foreign {
    double load = 0;        ///< share of the bus time, all possible stuff bits included
    double rate_hz = 0;     ///< frames per second
    std::uint32_t id = 0;   ///< the most frequent identifier, or one of several about equally frequent ones
    bool extended = false;  ///< `id` has 29 bits
  };

  static constexpr std::size_t kCycles = 4;

  explicit BusTraffic(const can::BitRates& rates) noexcept;

  /// Counts a received frame that no device of the bus sends, or that a device sends too often.
  void add_foreign(const can::Frame& frame) noexcept;

  /// Marks the end of a control cycle.
  void end_cycle(Time now) noexcept;

  /// Load and rate are zero until `kCycles` cycles have ended.
  [[nodiscard]] Foreign foreign() const noexcept;

  /// Resets all counts, as after a pause.
  void forget() noexcept;

 private:
  struct Cycle {
    Time ended{};
    Time foreign{};  // bus time
    std::uint32_t frames = 0;
  };
  [[nodiscard]] Time time_of(const can::Frame& frame) const noexcept;

  std::array<Time, can::kMaxPayload + 1> times_{};  // of a frame, by payload bytes
  Time extension_{};                                // additional time for 29 bits instead of 11
  Cycle present_;
  std::array<Cycle, kCycles> cycles_{};
  std::size_t next_ = 0;
  // Boyer-Moore majority vote over the identifiers.
  std::uint32_t candidate_ = 0;
  bool candidate_extended_ = false;
  std::uint32_t votes_ = 0;
};

}  // namespace walkman::canopen
