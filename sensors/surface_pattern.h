#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "sensors/periodic_noise.h"

namespace walkman::sensors {

/// Pattern printed on the surfaces of the world: a seeded procedural albedo, fixed to each body.
///
/// Every body has a base tone, a contrast, coarse blotches and a fine grain; the grain is strong in bright
/// blotches and fades in dark ones, so that there are patches without texture everywhere, more of them on
/// bodies of little contrast. The pattern of each body has a pose of its own, so that no two are alike and
/// none repeats along a flat side.
class SurfacePattern {
 public:
  static constexpr float kGrain = 0.0025F;  ///< m, size of the fine grain

  /// `bodies`: number of bodies; their patterns depend on `seed`.
  SurfacePattern(std::uint64_t seed, std::size_t bodies);

  /// Pose of a body's frame B in the frame P of its pattern.
  [[nodiscard]] const Eigen::Isometry3d& X_PB(std::size_t body) const { return looks_[body].X_PB; }

  /// Points of one body in the frame P of its pattern, m, each seen by a pixel that covers an area of
  /// `footprint`² (m²) of the surface; all spans have the same size. Within 100 m of the body's origin.
  struct Points {
    std::span<const float> x, y, z, footprint;
  };
  /// Writes the share of light that the body reflects at each point, within 0.02 and 0.98. Grain finer than a
  /// footprint averages out.
  void albedos(std::size_t body, const Points& points, std::span<float> out) const;
  /// Writes each point's rank: the probability that a random point of a random body, seen by a pixel that
  /// covers no more than a grain, has grain of less contrast than is left of this one's, 0 to 1.
  void ranks(std::size_t body, const Points& points, std::span<float> out) const;

 private:
  static constexpr std::size_t kBlotchLevels = 256;
  struct Look {
    float base = 0, contrast = 0;
    /// Of grain at the lower end of each blotch level, and at the end of the last.
    std::array<float, kBlotchLevels + 1> rank{};
    Eigen::Isometry3d X_PB = Eigen::Isometry3d::Identity();
  };
  // Shared by all bodies.
  [[nodiscard]] static const PeriodicNoise& grain();
  [[nodiscard]] static const PeriodicNoise& blotches();

  std::vector<Look> looks_;
  const PeriodicNoise& grain_;
  const PeriodicNoise& blotches_;
};

}  // namespace walkman::sensors
