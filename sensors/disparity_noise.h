#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sensors/match_texture.h"
#include "sensors/stereo_camera.h"
#include "sensors/stereo_rays.h"

namespace walkman::sensors {

/// Errors of a block matcher in a row of disparities: correlated and white noise, locking to whole
/// disparities, patches of mismatches, patches without a match, the lattice of the wire format, the limits of
/// the search.
///
/// Errors caused by the surfaces are fixed to them and persist from frame to frame (MatchTexture): the
/// correlated part of the noise, the patches without texture, and those where texture of little contrast
/// makes a wrong match the best one, in most frames. Where a surface is seen at an angle, the window contains
/// several disparities, and each piece of texture contributes its own; no match is found where they change by
/// a pixel from one pixel to the next (gradient limit of Burt and Julesz, Science 208, 1980; in matchers
/// Pollard, Mayhew, Frisby, Perception 14, 1985). Switching one kind of error off leaves the others
/// unchanged; those caused by the surfaces share what MatchTexture says of them.
class DisparityNoise {
 public:
  DisparityNoise(const StereoOptions& options, int workers);

  /// Draws a frame, except for the errors caused by its surfaces.
  void begin(std::uint64_t seed, std::uint64_t frame);
  /// Whether any of the errors are caused by the surfaces.
  [[nodiscard]] bool of_surfaces() const {
    return options_.sigma_d > 0 || options_.dropout_fraction > 0 || options_.spike_fraction > 0;
  }

  /// Distorts row `v` of `width` matched disparities (px, 0 = no match) in place. `slopes` of the row's true
  /// disparities; `points` that it shows, needed if `of_surfaces`. Afterwards a match has 0 < d <
  /// max_disparity and u − d >= 0. Rows may be distorted at the same time by different workers.
  void distort_row(int v, int worker, const DisparitySlopes& slopes, const SurfacePoints& points,
                   const SurfacePattern& pattern, float* matched);

 private:
  struct Scratch {
    std::vector<float> white;
    MatchTexture::Row texture;
  };

  void add_noise(int v, Scratch& scratch, const DisparitySlopes& slopes, float* matched) const;
  void lock(float* matched) const;
  /// Finds the row's mismatches and adds them.
  void add_mismatches(const MatchTexture::Row& texture, float* matched) const;
  void drop(std::span<const float> rank, float* matched) const;
  void quantize(float* matched) const;

  StereoOptions options_;
  std::uint64_t seed_ = 0, frame_ = 0;
  MatchTexture texture_;
  std::vector<Scratch> scratch_;
};

}  // namespace walkman::sensors
