#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sensors/correlated_field.h"
#include "sensors/match_texture.h"
#include "sensors/random_stream.h"
#include "sensors/stereo_camera.h"

namespace walkman::sensors {

/// What a block matcher does to a row of disparities: correlated and white noise, a pull to whole
/// disparities, blobs of wrong matches, patches without a match, the lattice of the wire format, the limits
/// of the search.
///
/// What comes of the surfaces is theirs and stays from frame to frame (MatchTexture): the correlated part of
/// the noise, and the patches without texture. Where a surface is seen at an angle the window holds several
/// disparities, of which each piece of texture makes its own; no match is found where they change by a pixel
/// from one to the next (gradient limit of Burt and Julesz, Science 208, 1980; in matchers Pollard, Mayhew,
/// Frisby, Perception 14, 1985). White noise and blobs draw from their own sequences, keyed by (seed, frame,
/// term, row or blob), so switching one off leaves the others as they were.
class DisparityNoise {
 public:
  DisparityNoise(const StereoOptions& options, int workers);

  /// Draws a frame, but for what its surfaces make. `disparity`: the true one, px, of rows `stride` apart; it
  /// is referred to until the next frame.
  void begin(std::uint64_t seed, std::uint64_t frame, const std::vector<float>& disparity, int stride);
  /// Whether anything of it is made by the surfaces.
  [[nodiscard]] bool of_surfaces() const { return options_.sigma_d > 0 || options_.dropout_fraction > 0; }
  /// What the surfaces make in row `v`, by the points that it shows. For every row, before any is distorted;
  /// rows are independent.
  void take_surfaces(int v, int worker, const SurfacePoints& points, const SurfacePattern& pattern);

  /// Distorts row `v` of `width` matched disparities (px, 0 = no match) in place. Afterwards a match has
  /// 0 < d < max_disparity and u − d >= 0. Rows are independent.
  void distort_row(int v, int worker, float* matched);

 private:
  struct Blob {
    int u, v, radius;
    float error;  // px
    std::uint64_t index;
  };
  struct Scratch {
    std::vector<float> a, b, gradient;
  };

  /// The white noise beyond the image's borders that row `index` of it has, from above the image on.
  [[nodiscard]] RandomStream beyond(int index) const;
  void draw_blobs();
  /// Squares of the true disparity's gradient along row `v`, px per px.
  void find_gradients(int v, std::vector<float>& gradient) const;
  void add_noise(int v, Scratch& scratch, float* matched) const;
  void lock(float* matched) const;
  void add_blobs(int v, float* matched) const;
  void drop(int v, float* matched) const;
  void quantize(float* matched) const;

  StereoOptions options_;
  std::uint64_t seed_ = 0, frame_ = 0;
  CorrelatedField noise_;
  std::vector<Blob> blobs_;
  std::vector<std::size_t> row_start_;  // of each row's entries in row_blob_, and the end
  std::vector<std::size_t> row_blob_;

  MatchTexture texture_;
  std::vector<std::uint8_t> blank_;  // of each pixel: there is nothing to match
  const float* disparity_ = nullptr;
  int stride_ = 0;

  std::vector<Scratch> scratch_;
};

}  // namespace walkman::sensors
