#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sensors/correlated_field.h"
#include "sensors/parallel_jobs.h"
#include "sensors/stereo_camera.h"

namespace walkman::sensors {

/// What a block matcher does to a row of disparities: correlated and white noise, blobs of wrong matches,
/// patches without a match, the lattice of the wire format, the limits of the search. Every term draws from
/// its own sequence, keyed by (seed, frame, term, row or blob), so switching one off leaves the others as
/// they were.
class DisparityNoise {
 public:
  DisparityNoise(const StereoOptions& options, int workers);

  /// Draws a frame.
  void begin(std::uint64_t seed, std::uint64_t frame, tbb::task_arena& arena);

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
    std::vector<float> a, b;
  };

  void draw_blobs();
  void add_noise(int v, Scratch& scratch, float* matched) const;
  void add_blobs(int v, float* matched) const;
  void drop(int v, Scratch& scratch, float* matched) const;
  void quantize(float* matched) const;

  StereoOptions options_;
  std::uint64_t seed_ = 0, frame_ = 0;
  CorrelatedField noise_;
  std::vector<Blob> blobs_;
  std::vector<std::size_t> row_start_;  // of each row's entries in row_blob_, and the end
  std::vector<std::size_t> row_blob_;

  CorrelatedField texture_;            // at one value a cell of kDropoutCell px
  float texture_threshold_ = 0;        // above it there is no match
  std::vector<float> texture_weight_;  // of the nearer and farther cell at each pixel of a cell

  std::vector<Scratch> scratch_;
};

}  // namespace walkman::sensors
