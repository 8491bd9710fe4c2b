#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "emulator/nodes/drive/drive_parameters.h"
#include "emulator/nodes/drive/servo_law.h"
#include "emulator/nodes/drive/servo_settings.h"

namespace walkman::nodes {

/// Keeps what one encoder's readings look like, so that the guilty one is known when two of them contradict
/// each other.
class EncoderWatch {
 public:
  /// `reading` in rad; `most`: the farthest it can have moved in this step, rad; `dt` in s.
  void step(double reading, double most, double dt) noexcept {
    const double moved = std::abs(reading - last_);  // NaN at the first
    still_for_ = moved == 0 ? still_for_ + dt : 0;
    jumped_ = jumped_ || moved > most;
    last_ = reading;
  }
  /// The readings agree again.
  void trust() noexcept { jumped_ = false; }
  /// It has not changed for `time` seconds.
  [[nodiscard]] bool frozen(double time) const noexcept { return still_for_ >= time; }
  [[nodiscard]] bool jumped() const noexcept { return jumped_; }

 private:
  double last_ = std::numeric_limits<double>::quiet_NaN();
  double still_for_ = 0;  // s
  bool jumped_ = false;
};

/// What a drive's electronics find wrong in their own measurements at each control step.
class Supervision {
 public:
  /// One finding: the bit in `causes`, and how it is told (603Fh, 1001h).
  struct Cause {
    std::uint8_t bit = 0;
    std::uint16_t code = 0;
    std::uint8_t register_bits = 0;
    bool uncontrollable = false;  ///< the motor cannot be braked by its loops any more
  };
  static const std::array<Cause, 7> kCauses;
  static const std::uint8_t kEncoders;  ///< bits of the causes in encoders

  explicit Supervision(const DriveParameters& parameters);

  /// One control step of `dt` seconds. `needs_supply`: the power stage is on, so that a low DC link is a
  /// fault.
  void step(const ServoFeedback& feedback, const ServoSettings& settings, bool needs_supply,
            double dt) noexcept;
  /// The limits are others now.
  void settings_changed() noexcept { seen_ = Housekeeping{}; }
  void reset() noexcept;

  /// Bits of the causes present at the last step.
  [[nodiscard]] std::uint8_t causes() const noexcept { return causes_; }
  /// Motor or board has reached 2030h:3: bit 7 of the statusword.
  [[nodiscard]] bool warning() const noexcept { return warning_; }
  /// The DC link is not below 2032h:1: bit 4 of the statusword.
  [[nodiscard]] bool supplied() const noexcept { return supplied_; }

 private:
  /// What changes slowly and is judged after a change only. NaN equals nothing.
  struct Housekeeping {
    double motor_c = std::numeric_limits<double>::quiet_NaN();
    double board_c = 0, supply = 0;
    bool needs_supply = false;
    friend bool operator==(const Housekeeping&, const Housekeeping&) = default;
  };
  void judge(const Housekeeping& seen, const ServoSettings& settings) noexcept;
  [[nodiscard]] std::uint8_t encoders(const ServoFeedback& feedback, double dt) noexcept;

  double impossible_deflection_;  // rad
  double fastest_;                // rad/s, beyond which a reading has jumped
  EncoderWatch motor_, link_;
  Housekeeping seen_;
  double over_current_for_ = 0;  // s
  std::uint8_t causes_ = 0, slow_causes_ = 0;
  bool warning_ = false;
  bool supplied_ = true;
};

}  // namespace walkman::nodes
