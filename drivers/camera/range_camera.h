#pragma once

#include <cstdint>
#include <stdexcept>
#include <vector>

#include <Eigen/Core>

#include "drivers/time.h"

namespace walkman::camera {

/// An organized cloud of a range camera: row-major, width × height, one point per pixel of the left rectified
/// image. Points are in the left optical frame (x right, y down, z forward), metres; invalid points are NaN
/// in all three.
struct OrganizedCloud {
  Time stamp{};             ///< instant of exposure, on the clock of `RangeCamera::latest`
  std::uint64_t frame = 0;  ///< frame counter
  int width = 0;
  int height = 0;
  std::vector<Eigen::Vector3f> points;

  [[nodiscard]] const Eigen::Vector3f& at(int column, int row) const {
    return points[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(column)];
  }
};

/// A camera that no longer answers, in one sentence.
class Lost : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A range camera as the robot's computer sees it: the newest complete cloud.
class RangeCamera {
 public:
  virtual ~RangeCamera() = default;

  /// Copies the newest cloud exposed at or after `not_before`, an instant of the reader's clock, on which the
  /// cloud's stamp then is too. False while there is none. Throws Lost.
  [[nodiscard]] virtual bool latest(Time not_before, OrganizedCloud& out) = 0;

  /// Turns the camera's laser at `rate` (rad/s) for a sweep, in which it sees every direction once; false
  /// when it has none. Throws Lost.
  [[nodiscard]] virtual bool begin_sweep(double rate) = 0;
  /// Once the sweep that was begun is complete: its points in the frame of the clouds (m), in no order, of a
  /// head that has been still. The laser then stops. False until then. Throws Lost.
  [[nodiscard]] virtual bool swept(std::vector<Eigen::Vector3f>& points) = 0;
};

}  // namespace walkman::camera
