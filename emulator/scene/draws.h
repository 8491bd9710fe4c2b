#pragma once

#include <cstdint>
#include <string_view>

namespace walkman {

/// Random numbers of a scene: SplitMix64 (Steele, Lea, Flood, OOPSLA 2014), since the standard library's
/// distributions differ between implementations.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : state_(seed) {}
  /// A separate sequence for every quantity of every part: adding a quantity or a part changes none of the
  /// others.
  Draws(std::uint64_t seed, std::string_view quantity, std::string_view part);

  [[nodiscard]] double symmetric();  ///< uniform in [-1, 1)
  [[nodiscard]] double uniform();    ///< in [0, 1)
  [[nodiscard]] double normal();     ///< of mean 0 and variance 1

 private:
  [[nodiscard]] std::uint64_t bits();

  std::uint64_t state_;
};

}  // namespace walkman
