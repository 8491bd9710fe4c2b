#pragma once

#include <cstdint>

#include "drivers/can/frame.h"
#include "drivers/time.h"
#include "emulator/nodes/cia301/object_dictionary.h"
#include "emulator/nodes/cia301/outbox.h"

namespace walkman::nodes {

/// SYNC consumer and producer (CiA 301, 7.2.5): COB-ID 1005h (bit 30 = produce, bit 31 is ignored), cycle
/// period 1006h and window 1007h in us, counter overflow 1019h (0, or 2 to 240; may be changed only while
/// 1006h is 0, else 0800 0022).
class Sync {
 public:
  /// Shortest period this device can produce.
  static constexpr std::uint32_t kShortestPeriodUs = 100;

  /// `now`: the node's clock, read when an object is written; must outlive this.
  Sync(ObjectDictionary& dictionary, Outbox& outbox, const Time& now);
  Sync(const Sync&) = delete;
  Sync& operator=(const Sync&) = delete;

  [[nodiscard]] std::uint32_t identifier() const noexcept { return identifier_; }
  /// Whether a SYNC has the length that 1019h requires: one byte with a counter, none without.
  [[nodiscard]] bool length_fits(const can::Frame& sync) const noexcept {
    return sync.length == (overflow_.get() != 0 ? 1 : 0);
  }
  /// Length of the window in which synchronous PDOs are valid; zero: no limit.
  [[nodiscard]] Time window() const noexcept { return std::chrono::microseconds(window_.get()); }

  /// Starts production, one period from `now`, or stops it. The counter begins with 1.
  void enable(bool enabled, Time now) noexcept;
  /// Applies the values now in the dictionary.
  void reload() noexcept;

  /// Returns true if a SYNC has just been sent; its counter, 0 without one, is `counter`.
  [[nodiscard]] bool advance(Time now) noexcept;
  [[nodiscard]] std::uint8_t counter() const noexcept { return counter_; }
  [[nodiscard]] Time next_event() const noexcept { return due_; }

 private:
  void schedule(Time from, std::uint32_t cob_id, std::uint32_t period_us) noexcept;

  Outbox& outbox_;
  Object<std::uint32_t> cob_id_, period_, window_;
  Object<std::uint8_t> overflow_;
  std::uint32_t identifier_ = 0;
  std::uint8_t counter_ = 0;
  bool enabled_ = false;
  Time due_ = Time::max();
};

}  // namespace walkman::nodes
