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

/// Thrown if a camera no longer answers; the text is one sentence.
class Lost : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A range camera as seen by the robot's computer: the newest complete cloud.
class RangeCamera {
 public:
  virtual ~RangeCamera() = default;

  /// Copies the newest cloud exposed at or after `not_before`, an instant on the reader's clock; the cloud's
  /// stamp is on that clock, too. Returns false while there is none. Throws Lost.
  [[nodiscard]] virtual bool latest(Time not_before, OrganizedCloud& out) = 0;

  /// Starts a sweep: turns the camera's laser at `rate` (rad/s) so that it sees every direction once. Returns
  /// false if the camera has no laser. Throws Lost.
  [[nodiscard]] virtual bool begin_sweep(double rate) = 0;
  /// Once the sweep is complete, returns its points in the frame of the clouds (m), in no particular order,
  /// and stops the laser; returns false until then. The head must not have moved. Throws Lost.
  [[nodiscard]] virtual bool swept(std::vector<Eigen::Vector3f>& points) = 0;
  /// Abandons a sweep that is not complete: tells the laser to stop, without waiting for it. No effect
  /// otherwise.
  virtual void end_sweep() noexcept = 0;
};

}  // namespace walkman::camera
