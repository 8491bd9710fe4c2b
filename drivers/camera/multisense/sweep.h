#pragma once

#include <functional>
#include <vector>

#include <Eigen/Geometry>

#include "drivers/camera/multisense/messages.h"
#include "drivers/time.h"

namespace walkman::multisense {

/// Puts laser scans together: each beam from where spindle and head were at its own time.
class Sweep {
 public:
  /// Throws std::runtime_error, one sentence, for transforms that are none.
  explicit Sweep(const LidarCalibration& calibration);

  struct Point {
    Eigen::Vector3f p_F;  ///< m
    float intensity = 0;  ///< device units
  };
  /// The returns of a scan. `X_FC`: left optical frame in F at a time of the sensor's clock; the spindle
  /// turns evenly from the scan's first to its last point.
  void add(const LidarData& scan, const std::function<Eigen::Isometry3d(Time)>& X_FC);

  [[nodiscard]] const std::vector<Point>& points() const { return points_; }
  /// By which the spindle has turned since the first scan, rad: half a turn shows every direction once.
  [[nodiscard]] double turned() const { return turned_; }

 private:
  Eigen::Isometry3d X_SpL_, X_CSp_;
  std::vector<Point> points_;
  double turned_ = 0, last_angle_ = 0;
  bool begun_ = false;
};

}  // namespace walkman::multisense
