#pragma once

#include <cstddef>
#include <cstdint>
#include <random>

namespace walkman::perception {

/// Seeded source of indices: the same numbers with every standard library, which the distributions of
/// <random> do not promise.
class RandomSource {
 public:
  explicit RandomSource(std::uint64_t seed) : generator_(seed) {}

  /// A number in [0, count); count > 0.
  [[nodiscard]] std::size_t index(std::size_t count) {
    return static_cast<std::size_t>(generator_() % count);
  }

 private:
  std::mt19937_64 generator_;
};

}  // namespace walkman::perception
