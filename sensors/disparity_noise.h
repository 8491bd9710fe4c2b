#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sensors/correlated_field.h"
#include "sensors/match_texture.h"
#include "sensors/random_stream.h"
#include "sensors/stereo_camera.h"

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

  /// Draws a frame, except for the errors caused by its surfaces. `disparity`: true disparity, px, in rows
  /// `stride` apart; it is referenced until the next frame.
  void begin(std::uint64_t seed, std::uint64_t frame, const std::vector<float>& disparity, int stride);
  /// Whether any of the errors are caused by the surfaces.
  [[nodiscard]] bool of_surfaces() const {
    return options_.sigma_d > 0 || options_.dropout_fraction > 0 || options_.spike_fraction > 0;
  }
  /// Determines the errors caused by the surfaces in row `v`, from the points that it shows. Call for every
  /// row before any is distorted; rows are independent.
  void take_surfaces(int v, int worker, const SurfacePoints& points, const SurfacePattern& pattern);

  /// Distorts row `v` of `width` matched disparities (px, 0 = no match) in place. Afterwards a match has
  /// 0 < d < max_disparity and u − d >= 0. Rows are independent.
  void distort_row(int v, int worker, float* matched);

 private:
  struct Mismatch {
    int u;
    float error;  // px
  };
  struct Scratch {
    std::vector<float> a, b, gradient;
    std::vector<std::uint32_t> patch;
  };

  /// Stream for the part of the white noise's row `index`, counted from above the image, beyond its borders.
  [[nodiscard]] RandomStream beyond(int index) const;
  /// Finds the mismatches of row `v`: `error`, `rank` and `patch` as MatchTexture gives them.
  void find_mismatches(int v, std::span<const float> error, std::span<const float> rank,
                       std::span<const std::uint32_t> patch);
  /// Squared gradients of the true disparity along row `v`, px per px.
  void find_gradients(int v, std::vector<float>& gradient) const;
  void add_noise(int v, Scratch& scratch, float* matched) const;
  void lock(float* matched) const;
  void add_mismatches(int v, float* matched) const;
  void drop(int v, float* matched) const;
  void quantize(float* matched) const;

  StereoOptions options_;
  std::uint64_t seed_ = 0, frame_ = 0;
  CorrelatedField noise_;
  std::vector<std::vector<Mismatch>> mismatches_;  // of each row
  MatchTexture texture_;
  std::vector<std::uint8_t> blank_;  // of each pixel: nothing to match
  const float* disparity_ = nullptr;
  int stride_ = 0;

  std::vector<Scratch> scratch_;
};

}  // namespace walkman::sensors
