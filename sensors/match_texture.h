#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sensors/surface_points.h"

namespace walkman::sensors {

/// What a block matcher has to match: the texture of the surfaces that the left image shows, fixed to their
/// bodies. A still scene has the same from frame to frame, and so do the errors that come of it.
class MatchTexture {
 public:
  MatchTexture(int width, int workers);

  /// Prepares a frame.
  void begin(std::uint64_t seed) { seed_ = seed; }

  /// Row `v` of pixels by the points that it shows, in their bodies. `error`: normal, of mean 0 and variance
  /// 1, of the place on the surface that a pixel shows, no two pixels' alike. `rank`: the share of all
  /// surfaces that has less grain, 0 to 1; 1 where there is no surface. Rows are independent.
  void row(int v, int worker, const SurfacePoints& points, const SurfacePattern& pattern,
           std::span<float> error, std::span<float> rank);

 private:
  struct Worker {
    std::vector<std::uint32_t> bits;
    std::vector<float> values;
  };
  std::uint64_t seed_ = 0;
  std::vector<Worker> workers_;
};

}  // namespace walkman::sensors
