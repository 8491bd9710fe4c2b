#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace walkman::sensors {

/// Pattern printed on the surfaces of the world: a seeded procedural albedo, fixed to each body.
///
/// Every body has a base tone, a contrast, coarse blotches and a fine grain; the grain is strong in bright
/// blotches and fades in dark ones, so that there are patches without texture everywhere, more of them on
/// bodies of little contrast.
class SurfacePattern {
 public:
  static constexpr float kGrain = 0.0025F;  ///< m, size of the fine grain

  /// `bodies`: number of bodies; their patterns depend on `seed`.
  SurfacePattern(std::uint64_t seed, std::size_t bodies);

  /// Points of one body in its own frame, m, each seen by a pixel that covers `footprint` (m) of the surface;
  /// all spans have the same size. Within 100 m of the body's origin.
  struct Points {
    std::span<const float> x, y, z, footprint;
  };
  /// Writes the share of light that the body reflects at each point, within 0.02 and 0.98. Grain finer than a
  /// footprint averages out.
  void albedos(std::size_t body, const Points& points, std::span<float> out) const;
  /// Writes each point's rank: the probability that a random point of a random body has grain of less
  /// contrast, 0 to 1.
  void ranks(std::size_t body, const Points& points, std::span<float> out) const;

 private:
  static constexpr std::size_t kBlotchLevels = 256;
  struct Look {
    float base = 0, contrast = 0;
    /// Of grain at the lower end of each blotch level, and at the end of the last.
    std::array<float, kBlotchLevels + 1> rank{};
    Eigen::Vector3f shift = Eigen::Vector3f::Zero();  // of the pattern, m
  };
  /// Noise in a cube that repeats in all directions: equally likely values, 0 to 255.
  struct Noise {
    int bits;         // of the number of cells per side
    float per_metre;  // cells
    std::vector<std::uint8_t> cells;
  };
  static void find(const Noise& noise, const Look& look, const Points& points, std::size_t first,
                   std::span<int> at);
  [[nodiscard]] static Noise make_noise(int bits, float cell, double blur);
  // Shared by all bodies, which are shifted within them.
  [[nodiscard]] static const Noise& grain();
  [[nodiscard]] static const Noise& blotches();

  std::vector<Look> looks_;
  const Noise& grain_;
  const Noise& blotches_;
};

}  // namespace walkman::sensors
