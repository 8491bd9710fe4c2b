#pragma once

#include <cstdint>
#include <optional>

#include "drivers/cia402/words.h"

namespace walkman::nodes {

/// Option codes that determine how operation enabled is left.
struct LeavingOptions {
  int quick_stop = 2;  ///< 605Ah
  int shutdown = 0;    ///< 605Bh
  int disable = 1;     ///< 605Ch
};

/// The power state machine of a CiA 402 drive (IEC 61800-7-201, figure of transitions 0..16), without time:
/// the end of a stop is reported from outside.
class PowerState {
 public:
  [[nodiscard]] cia402::State state() const noexcept { return state_; }
  /// Whether torque is applied: operation enabled, or slowing down on the way out of it.
  [[nodiscard]] bool powered() const noexcept {
    return state_ == cia402::State::kOperationEnabled || stopping();
  }
  /// Whether it is slowing down by quick stop or fault reaction, or on the way out of operation enabled.
  [[nodiscard]] bool stopping() const noexcept {
    return state_ == cia402::State::kQuickStopActive || state_ == cia402::State::kFaultReactionActive ||
           leaving();
  }
  /// Whether operation is enabled and not being left.
  [[nodiscard]] bool driving() const noexcept {
    return state_ == cia402::State::kOperationEnabled && !leaving();
  }
  /// Whether operation is enabled only until the ramp of a shutdown or disable operation has ended (605Bh,
  /// 605Ch = 1).
  [[nodiscard]] bool leaving() const noexcept { return leaving_for_.has_value(); }

  /// Makes transitions 0 and 1: initialised.
  void ready() noexcept;
  /// Makes transitions 2..12, 15 and 16. `cause_gone`: whether a fault may be reset. The edge of bit 7 is
  /// detected here, from the word of the last call. Enable operation cancels a ramp out of operation enabled.
  void command(std::uint16_t controlword, const LeavingOptions& options, bool cause_gone) noexcept;
  /// Disable voltage, performed by the drive itself when it loses its master.
  void disable_voltage() noexcept;
  /// Quick stop for the same reason; `quick_stop_option`: 605Ah, with 0 the drive coasts.
  void quick_stop(int quick_stop_option) noexcept;
  /// Makes transition 13, and 14 at once if there is nothing to stop or `coast` is set.
  void fault(bool coast) noexcept;
  /// Call when the motor has come to rest: makes transition 14, 5, 8, or 12 unless the drive stays in quick
  /// stop (605Ah 5..8).
  void stopped(int quick_stop_option) noexcept;
  /// Returns to the power-on state: not ready to switch on.
  void reset() noexcept;

 private:
  void move_to(cia402::State state) noexcept;

  cia402::State state_ = cia402::State::kNotReadyToSwitchOn;
  std::optional<cia402::State> leaving_for_;
  std::uint16_t last_word_ = 0;
};

/// Bits 0-6 and 9 of the statusword in a state; bit 4 (voltage) and bit 9 (remote) are set once initialised.
[[nodiscard]] std::uint16_t status_bits(cia402::State state) noexcept;

}  // namespace walkman::nodes
