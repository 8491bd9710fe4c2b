#pragma once

#include <cstdint>

namespace walkman::sensors {

/// A counter-based random sequence: value i is a function of the key and of i alone, so any thread can
/// compute any part of it in any order. The mixing is SplitMix64's finalizer (Steele, Lea, Flood, OOPSLA
/// 2014).
class RandomStream {
 public:
  /// Distinct tuples give unrelated sequences. `term` says what is drawn, `index` for which row or item.
  RandomStream(std::uint64_t seed, std::uint64_t frame, std::uint64_t term, std::uint64_t index)
      : key_(mix(mix(mix(mix(seed + kStep) ^ frame) + term) ^ index)) {}

  /// 64 uniformly distributed bits.
  [[nodiscard]] std::uint64_t bits(std::uint64_t i) const { return mix(key_ + (i + 1) * kStep); }

  /// Uniform in [0, 1), 24 bits.
  [[nodiscard]] float uniform(std::uint64_t i) const { return static_cast<float>(bits(i) >> 40) * 0x1p-24F; }

 private:
  static constexpr std::uint64_t kStep = 0x9E3779B97F4A7C15;
  static constexpr std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
    return z ^ (z >> 31);
  }

  std::uint64_t key_;
};

}  // namespace walkman::sensors
