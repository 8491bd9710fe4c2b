#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <Eigen/Geometry>

#include "sensors/painted_surfaces.h"
#include "sensors/parallel_jobs.h"

namespace walkman::sensors {

/// A UTM-30LX-EW and its errors. Zero disables an error term.
struct LidarOptions {
  int beams = 1081;
  double step = 0.0043633231299858237;        ///< rad between beams: 360°/1440 (SCIP 2.0)
  double beam_period = 0.025 / 1440;          ///< s: a turn of the mirror in 25 ms (data sheet: 40 Hz)
  double least_range = 0.1, most_range = 30;  ///< m (data sheet)
  /// Half angle of the beam, and its radius at the exit (Pomerleau et al., CARPI 2012).
  double beam_angle = 0.0006, beam_radius = 0.0015;  ///< rad, m
  /// Standard deviations: up to 10 m at normal incidence, measured as 6 to 8 mm on a MultiSense; at 30 m,
  /// half the data sheet's limit of 30 mm; at grazing incidence (Photonics 5(2):12: 10.5 mm). In between, the
  /// first rises linearly with the range, and what grazing adds to it with 1 − cos of the angle of incidence.
  double noise = 0.007, noise_far = 0.015, noise_grazing = 0.0105;  ///< m
  double bias = 0.006;  ///< m, standard deviation of the device's own offset: ±30 mm is three sigma of both
  /// Surfaces closer together than this return a single echo, anywhere between them: half the length of a
  /// pulse of about 2.5 ns.
  double pulse = 0.4;  ///< m
  /// Reflectance still detected at `most_range` at normal incidence: white paper (data sheet). Darker
  /// surfaces are detected up to the range at which they return as much light.
  double least_reflectance = 0.9;
  double intensity = 4000;  ///< of a total reflector at 1 m, device units; varies as the root of its echo

  /// The same device without noise and bias, with its beam reduced to a line.
  [[nodiscard]] LidarOptions noise_free() const;
};

/// One turn of the mirror. Beam i points along (sin m, 0, cos m) in its laser frame, m = (i − (n − 1)/2) ·
/// step.
struct LidarScan {
  std::vector<float> ranges;       ///< m; infinite without a return
  std::vector<float> intensities;  ///< device units, 0 without a return
};

/// Casts a laser scanner's beams, each from the laser's pose at the time of that beam. Deterministic in
/// (scene, poses, seed, scan).
class SpinningLidar {
 public:
  /// Throws std::invalid_argument for options out of range.
  SpinningLidar(const LidarOptions& options, std::uint64_t seed);
  ~SpinningLidar();

  /// `X_WL`: pose of the laser frame (z along the middle beam, y the axis of the mirror) at `seconds` from
  /// the first beam. The scene keeps the poses last placed during a scan.
  void scan(const RayScene& scene, const std::function<Eigen::Isometry3d(double seconds)>& X_WL,
            std::uint64_t number, LidarScan& out);

  [[nodiscard]] const LidarOptions& options() const { return options_; }

 private:
  struct Impl;
  void read(std::size_t beam, std::uint64_t number, LidarScan& out) const;

  LidarOptions options_;
  std::uint64_t seed_;
  double bias_;  // m
  PaintedSurfaces surfaces_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace walkman::sensors
