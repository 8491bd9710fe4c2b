#pragma once

#include <array>
#include <cstdint>

namespace walkman::cia404 {

/// Detects noisy readings that have lost their noise: three channels that all keep repeating themselves are
/// no longer a measurement, even if their counter advances.
///
/// Judges only after the readings were seen not to repeat themselves: as long as less than half of the last
/// samples equal their predecessors. `kMost` in a row are then less likely than once in a thousand hours at
/// 200 samples per second.
class RepeatWatch {
 public:
  using Reading = std::array<std::int16_t, 3>;
  static constexpr int kMost = 40;

  /// Takes the next sample.
  void take(const Reading& reading) noexcept;
  /// Restarts the count; does not forget that the readings had noise.
  void restart() noexcept { repeats_ = frozen_ = 0; }
  /// Number of identical samples in a row if that is too many; otherwise 0.
  [[nodiscard]] int frozen() const noexcept { return frozen_; }

 private:
  Reading last_{};
  int taken_ = 0;         // up to `kMost`
  double repeating_ = 1;  // share of the last samples that repeat the one before
  bool lively_ = false;   // that share was below half before the present repeats
  int repeats_ = 0;
  int frozen_ = 0;
};

}  // namespace walkman::cia404
