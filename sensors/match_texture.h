#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sensors/surface_points.h"

namespace walkman::sensors {

/// Texture that a block matcher has to match: that of the surfaces shown by the left image, fixed to their
/// bodies. In a static scene it is the same from frame to frame, and so are the errors that it causes.
class MatchTexture {
 public:
  MatchTexture(int width, int workers);

  /// Prepares a frame.
  void begin(std::uint64_t seed) { seed_ = seed; }

  /// Computes row `v` of pixels from the points that it shows, in the frames of their bodies. `error`:
  /// normally distributed with mean 0 and variance 1, belonging to the place on the surface that a pixel
  /// shows, different for any two pixels. `rank`: that of SurfacePattern; 1 where there is no surface.
  /// `patch`: random bits of the patch of surface that a pixel shows, 3 to 6 px wide if it faces the camera;
  /// 0 where there is no surface. Rows are independent.
  void row(int v, int worker, const SurfacePoints& points, const SurfacePattern& pattern,
           std::span<float> error, std::span<float> rank, std::span<std::uint32_t> patch);

 private:
  struct Worker {
    std::vector<std::uint32_t> bits, patches;
    std::vector<float> values;
  };
  std::uint64_t seed_ = 0;
  std::vector<Worker> workers_;
};

}  // namespace walkman::sensors
