#pragma once

#include <array>
#include <cstdint>

#include "drivers/can/frame.h"
#include "drivers/can/frame_time.h"

namespace walkman::canopen {

/// What one bus has carried in the last few cycles, as this computer sees it: how much of it nobody asked
/// for, and under which identifier most of that came. Nothing in it allocates.
class BusTraffic {
 public:
  /// Of the last `kCycles` cycles.
  struct Foreign {
    double load = 0;        ///< share of the bus time, every frame with all its stuff bits
    double rate_hz = 0;     ///< frames per second
    std::uint32_t id = 0;   ///< the most frequent identifier, or one of several that are about equally so
    bool extended = false;  ///< that has 29 bits
  };

  static constexpr std::size_t kCycles = 4;

  explicit BusTraffic(const can::BitRates& rates) noexcept;

  /// A received frame that no device of the bus sends, or that one sends too often.
  void add_foreign(const can::Frame& frame) noexcept;

  /// A control cycle has ended.
  void end_cycle(Time now) noexcept;

  /// Zeros until `kCycles` cycles have ended.
  [[nodiscard]] Foreign foreign() const noexcept;

  /// Begins anew, as after a pause.
  void forget() noexcept;

 private:
  struct Cycle {
    Time ended{};
    Time foreign{};  // bus time
    std::uint32_t frames = 0;
  };
  [[nodiscard]] Time time_of(const can::Frame& frame) const noexcept;

  std::array<Time, can::kMaxPayload + 1> times_{};  // of a frame with so many bytes
  Time extension_{};                                // of 29 bits instead of 11
  Cycle present_;
  std::array<Cycle, kCycles> cycles_{};
  std::size_t next_ = 0;
  // The majority vote of Boyer and Moore over the identifiers.
  std::uint32_t candidate_ = 0;
  bool candidate_extended_ = false;
  std::uint32_t votes_ = 0;
};

}  // namespace walkman::canopen
