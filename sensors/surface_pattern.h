#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace walkman::sensors {

/// What is printed on the surfaces of the world: a seeded procedural albedo, fixed to each body.
///
/// Every body has a base tone, coarse blotches and a fine grain; the grain is strong in bright blotches and
/// fades in dark ones, so that there are patches without texture everywhere, more of them on some bodies.
class SurfacePattern {
 public:
  static constexpr float kGrain = 0.0025F;  ///< m, size of the fine grain

  /// `bodies`: how many there are; they differ by `seed`.
  SurfacePattern(std::uint64_t seed, std::size_t bodies);

  /// Points of one body in its own frame, m, each seen by a pixel that covers `footprint` (m) of the surface;
  /// all of one size. Within 100 m of the body's origin.
  struct Points {
    std::span<const float> x, y, z, footprint;
  };
  /// The share of light that the body returns at each, within 0.02 and 0.98. Grain finer than a footprint
  /// averages out.
  void albedos(std::size_t body, const Points& points, std::span<float> out) const;
  /// The share of all surfaces that has less grain than there is at each, 0 to 1.
  void ranks(std::size_t body, const Points& points, std::span<float> out) const;

 private:
  struct Look {
    float base = 0, contrast = 0;
    Eigen::Vector3f shift = Eigen::Vector3f::Zero();  // of the pattern, m
  };
  /// Noise in a cube that repeats in all directions: equally likely values, 0 to 255.
  struct Noise {
    int bits;         // of a side's cells
    float per_metre;  // cells
    std::vector<std::uint8_t> cells;
  };
  static void find(const Noise& noise, const Look& look, const Points& points, std::size_t first,
                   std::span<int> at);
  [[nodiscard]] static Noise make_noise(int bits, float cell, double blur);
  // The same for all: bodies are shifted within them.
  [[nodiscard]] static const Noise& grain();
  [[nodiscard]] static const Noise& blotches();

  std::vector<Look> looks_;
  const Noise& grain_;
  const Noise& blotches_;
};

}  // namespace walkman::sensors
