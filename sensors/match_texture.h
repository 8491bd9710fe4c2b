#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sensors/surface_points.h"

namespace walkman::sensors {

/// Texture that a block matcher has to match: that of the surfaces shown by the left image, fixed to their
/// bodies. In a static scene it is the same from frame to frame, and so are the errors that it causes, also
/// while the camera sways by parts of a pixel.
class MatchTexture {
 public:
  /// `correlation_px`: see `row`; below 0.25 px, where neighbours are independent already, as 0.25 px.
  explicit MatchTexture(double correlation_px);

  /// Prepares a frame.
  void begin(std::uint64_t seed) { seed_ = seed; }

  /// What a row of pixels shows, one value each.
  struct Row {
    /// Normally distributed with mean 0 and variance 1. A property of the surface: for places r px apart on
    /// one that faces the camera, the correlation is about exp(−r²/4s²), s = correlation_px.
    /// Where there is no surface, that of the one beside it.
    std::vector<float> error;
    std::vector<float> rank;           ///< that of SurfacePattern; 1 where there is no surface
    std::vector<std::uint32_t> patch;  ///< random bits of the patch of surface, 3 to 6 px wide if it faces
                                       ///< the camera; 0 where there is no surface
  };
  /// Computes a row of `width` pixels from the points that it shows. Rows may be computed at the same time.
  void row(std::size_t width, const SurfacePoints& points, const SurfacePattern& pattern, Row& out) const;

 private:
  void errors(const SurfacePoints& points, const SurfacePoints::Run& run, std::uint64_t key,
              std::span<float> out) const;
  static void spread(std::size_t width, const SurfacePoints& points, Row& out);

  float correlation_px_;
  std::uint64_t seed_ = 0;
  std::array<float, 256> normal_;  // value of each of the noise's levels
};

}  // namespace walkman::sensors
