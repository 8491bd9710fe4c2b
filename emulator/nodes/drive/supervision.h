#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "emulator/nodes/drive/drive_parameters.h"
#include "emulator/nodes/drive/servo_law.h"
#include "emulator/nodes/drive/servo_settings.h"

namespace walkman::nodes {

/// Tracks the readings of one encoder, so that the faulty one can be identified if two of them contradict
/// each other.
class EncoderWatch {
 public:
  /// `reading` in rad; `most`: largest possible movement in this step, rad; `dt` in s.
  void step(double reading, double most, double dt) noexcept {
    const double moved = std::abs(reading - last_);  // NaN at the first
    still_for_ = moved == 0 ? still_for_ + dt : 0;
    jumped_ = jumped_ || moved > most;
    last_ = reading;
  }
  /// Notes that the readings agree again.
  void trust() noexcept { jumped_ = false; }
  /// Whether the reading has not changed for `time` seconds.
  [[nodiscard]] bool frozen(double time) const noexcept { return still_for_ >= time; }
  [[nodiscard]] bool jumped() const noexcept { return jumped_; }

 private:
  double last_ = std::numeric_limits<double>::quiet_NaN();
  double still_for_ = 0;  // s
  bool jumped_ = false;
};

/// Faults that a drive's electronics detect in their own measurements at each control step.
class Supervision {
 public:
  /// One finding: its bit in `causes`, and how it is reported (603Fh, 1001h).
  struct Cause {
    std::uint8_t bit = 0;
    std::uint16_t code = 0;
    std::uint8_t register_bits = 0;
    bool uncontrollable = false;  ///< the motor can no longer be braked by its loops
  };
  static const std::array<Cause, 7> kCauses;
  static const std::uint8_t kEncoders;  ///< bits of the encoder causes

  explicit Supervision(const DriveParameters& parameters);

  /// Runs one control step of `dt` seconds. `needs_supply`: the power stage is on, so that a low DC link
  /// voltage is a fault.
  void step(const ServoFeedback& feedback, const ServoSettings& settings, bool needs_supply,
            double dt) noexcept;
  /// Notes that the limits have changed.
  void settings_changed() noexcept { seen_ = Housekeeping{}; }
  void reset() noexcept;

  /// Bits of the causes present at the last step.
  [[nodiscard]] std::uint8_t causes() const noexcept { return causes_; }
  /// Whether motor or board has reached 2030h:3: bit 7 of the statusword.
  [[nodiscard]] bool warning() const noexcept { return warning_; }
  /// Whether the DC link is not below 2032h:1: bit 4 of the statusword.
  [[nodiscard]] bool supplied() const noexcept { return supplied_; }

 private:
  /// Quantities that change slowly and are judged only after a change. NaN equals nothing.
  struct Housekeeping {
    double motor_c = std::numeric_limits<double>::quiet_NaN();
    double board_c = 0, supply = 0;
    bool needs_supply = false;
    friend bool operator==(const Housekeeping&, const Housekeeping&) = default;
  };
  void judge(const Housekeeping& seen, const ServoSettings& settings) noexcept;
  [[nodiscard]] std::uint8_t encoders(const ServoFeedback& feedback, double dt) noexcept;

  double impossible_deflection_;  // rad
  double fastest_;                // rad/s; a reading that changes faster has jumped
  EncoderWatch motor_, link_;
  Housekeeping seen_;
  double over_current_for_ = 0;  // s
  std::uint8_t causes_ = 0, slow_causes_ = 0;
  bool warning_ = false;
  bool supplied_ = true;
};

}  // namespace walkman::nodes
