#pragma once

#include <functional>
#include <vector>

#include <Eigen/Geometry>

#include "drivers/camera/multisense/messages.h"
#include "drivers/time.h"

namespace walkman::multisense {

/// Assembles laser scans: places each beam by the poses of spindle and head at the time of that beam.
class Sweep {
 public:
  /// Throws std::runtime_error (one sentence) if a transform is not rigid.
  explicit Sweep(const LidarCalibration& calibration);

  struct Point {
    Eigen::Vector3f p_F;  ///< m
    float intensity = 0;  ///< device units
  };
  /// Adds the returns of a scan. `X_FC`: pose of the left optical frame in F at a time on the sensor's clock.
  /// The spindle is assumed to turn at a constant rate from the scan's first to its last point.
  void add(const LidarData& scan, const std::function<Eigen::Isometry3d(Time)>& X_FC);

  [[nodiscard]] const std::vector<Point>& points() const { return points_; }
  /// Angle the spindle has turned since the first scan, rad: half a turn covers every direction once.
  [[nodiscard]] double turned() const { return turned_; }

 private:
  Eigen::Isometry3d X_SpL_, X_CSp_;
  std::vector<Point> points_;
  double turned_ = 0, last_angle_ = 0;
  bool begun_ = false;
};

}  // namespace walkman::multisense
