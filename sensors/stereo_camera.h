#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Geometry>

#include "sensors/ray_scene.h"

namespace walkman::sensors {

/// Rectified stereo geometry of a MultiSense-SL and its noise. Zero disables a noise term.
///
/// The terms act on the disparity, in this order: occlusion by the right camera and the edge of its view,
/// foreground fattening, correlated and white noise, locking to whole pixels, patches of mismatches, dropout,
/// rounding to the lattice, search range. x, y and z follow from the result by the rectified model, so their
/// errors are correlated.
struct StereoOptions {
  int width = 1024, height = 1024;
  double focal_px = 588.8;        ///< unit 05's rectified focal length at 1024 px
  double cx = 511.5, cy = 511.5;  ///< px, pixel centres at whole numbers
  double baseline = 0.07;         ///< m
  double min_depth = 0.05;        ///< m, nearer surfaces are inside the housing
  int max_disparity = 128;        ///< search range, px; a match is below it
  double sigma_d = 0.2;           ///< px, standard deviation of the disparity
  double correlation_px = 2.0;  ///< Gaussian filter of the 0.8 part of the noise, px; the other 0.6 is white
  double locking = 0.05;        ///< px, largest shift of a match towards a whole disparity
  int fattening_px = 3;         ///< half of the matching window, foreground leak at edges
  double spike_fraction = 0.002;  ///< fraction of pixels with a mismatch, averaged over surfaces and frames
  double dropout_fraction =
      0.03;  ///< fraction of pixels without a match (low texture), averaged over surfaces
  double disparity_step = 1.0 / 16;  ///< px, lattice of the wire format
  int threads = 2;

  /// The same camera without noise, mismatches and lattice; occlusion by the second camera stays.
  [[nodiscard]] StereoOptions noise_free() const;
};

/// Rectified intensity images of a pair: 8 bits, linear in light, row-major.
struct StereoImages {
  std::vector<std::uint8_t> left, right;
};

/// Casts the left image of a stereo pair and returns what a matcher would: disparities, 0 where the right
/// camera cannot see the point or no match was found. Deterministic in (scene, pose, seed, frame), for any
/// number of threads.
class StereoCamera {
 public:
  /// Throws std::invalid_argument naming the option that is out of range.
  explicit StereoCamera(StereoOptions options);
  ~StereoCamera();

  /// X_WC: pose of the left optical frame (x right, y down, z forward). `disparity` gets width*height
  /// entries, row-major, px: left pixel u shows the same point as right pixel u − d.
  /// `images`: receives the images of the two imagers, unless null; it does not affect the disparity.
  /// Throws std::invalid_argument for a non-finite pose, std::logic_error for a scene whose movable bodies
  /// have no poses yet.
  void capture(const RayScene& scene, const Eigen::Isometry3d& X_WC, std::uint64_t seed, std::uint64_t frame,
               std::vector<float>& disparity, StereoImages* images = nullptr);

  [[nodiscard]] const StereoOptions& options() const { return options_; }

 private:
  StereoOptions options_;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace walkman::sensors
