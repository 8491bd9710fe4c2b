#pragma once

#include <array>
#include <cstdint>

namespace walkman::cia404 {

/// Whether readings that have noise still have it: three channels that all repeat themselves, again and
/// again, are no measurement any more, however well their counter runs.
///
/// Judged only after it was seen that they do not repeat themselves: as long as less than half of the last
/// samples equal the ones before them. `kMost` in a row are then less likely than once in a thousand hours at
/// 200 samples a second.
class RepeatWatch {
 public:
  using Reading = std::array<std::int16_t, 3>;
  static constexpr int kMost = 40;

  /// The next sample.
  void take(const Reading& reading) noexcept;
  /// Begins to count anew; that the readings had noise is not forgotten.
  void restart() noexcept { repeats_ = frozen_ = 0; }
  /// How many samples in a row are the same, when that is too many; else 0.
  [[nodiscard]] int frozen() const noexcept { return frozen_; }

 private:
  Reading last_{};
  int taken_ = 0;         // up to `kMost`
  double repeating_ = 1;  // share of the last samples that repeat the one before
  bool lively_ = false;   // that share, before the present repeats began
  int repeats_ = 0;
  int frozen_ = 0;
};

}  // namespace walkman::cia404
