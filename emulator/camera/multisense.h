#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "drivers/camera/multisense/messages.h"
#include "drivers/time.h"
#include "emulator/camera/camera_parameters.h"
#include "emulator/camera/head_imu.h"
#include "emulator/camera/laser.h"
#include "emulator/plant/plant.h"
#include "emulator/scene/scene.h"
#include "sensors/ray_scene.h"
#include "sensors/stereo_camera.h"

namespace walkman {

/// Faults of the camera.
struct CameraFault {
  bool blind = false;      ///< nothing is exposed
  bool stale = false;      ///< the last exposure is delivered repeatedly, with its stamp
  double dropout = 0;      ///< share of the pixels without a match, in addition to the matcher's
  std::uint64_t seed = 1;  ///< seed of the choice of these pixels
  Eigen::Isometry3d X_CF =
      Eigen::Isometry3d::Identity();  ///< true pose of the left camera in its nominal frame
  /// A square in the middle of the image that is matched at a distance where there is nothing.
  struct Phantom {
    int size = 0;         ///< px
    double distance = 0;  ///< m
  };
  std::optional<Phantom> phantom;
  /// Columns without a match, as shares of the image's width.
  struct Hidden {
    double from = 0, to = 0;
  };
  Hidden hidden;
};

/// Where everything was at an exposure of the camera: enough to render the frame at any later time.
struct Exposure {
  Time stamp = Time::min();  ///< `Time::min()`: no exposure so far
  std::uint64_t frame = 0;
  Eigen::Isometry3d X_WC = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Isometry3d> poses;  ///< of the ray scene's movable bodies
  double spindle_angle = 0;              ///< rad
  double dropout = 0;                    ///< share of the pixels that a fault leaves without a match
  std::uint64_t dropout_seed = 1;
  std::optional<CameraFault::Phantom> phantom;
  CameraFault::Hidden hidden;
};

/// The head's stereo camera: exposes the plant at its frame rate and matches the images.
///
/// An exposure only records where everything is; the rays are cast when that frame is requested, with the
/// same result. Frames that nobody requests cost nothing.
class MultiSense {
 public:
  /// An image size and search range, px.
  struct Mode {
    int width = 0, height = 0, disparities = 0;
    [[nodiscard]] bool operator==(const Mode&) const = default;
  };

  /// `optical_link`: robot link index of the left optical frame. The image of `parameters` is the initial
  /// mode, and defines the optics of all modes.
  MultiSense(const RobotModel& robot, const Scene& scene, int optical_link,
             const CameraParameters& parameters, std::uint64_t seed);

  /// Replaces the previous fault from the next exposure on.
  void set_fault(const CameraFault& fault) { fault_ = fault; }
  /// Takes an exposure if a frame is due at `now`.
  void advance(Time now, const plant::Plant& plant);

  [[nodiscard]] Time now() const { return now_; }
  /// The newest exposure.
  [[nodiscard]] const Exposure& exposure() const { return exposure_; }
  /// The newest turns of the laser's mirror; none for a camera without a laser.
  [[nodiscard]] const LaserTurns& turns() const;
  /// Commanded rate of the spindle, rad/s. May be called from any thread.
  [[nodiscard]] double spindle_rate() const { return spindle_rate_; }
  void turn_spindle(double rate) { spindle_rate_ = rate; }

  // The functions below may run in a different thread from `advance`, but only in one at a time.

  [[nodiscard]] const sensors::StereoOptions& optics() const { return camera_->options(); }
  [[nodiscard]] Mode mode() const;
  /// Takes effect with the next frame that is cast. The optics scale with the width; if there are more rows
  /// than wanted, the middle ones are kept.
  void set_mode(const Mode& mode);
  [[nodiscard]] double rate_hz() const;
  void set_rate(double rate_hz) { period_ns_ = period_of(rate_hz); }

  /// Result of an exposure.
  struct Frame {
    multisense::Disparity disparity;
    multisense::Image left, right;  ///< rectified luma
  };
  /// Casts the rays of an exposure and matches them; with `images`, also renders what the two imagers see.
  void render(const Exposure& exposure, bool images, Frame& out);
  /// Casts the beams of a turn.
  void scan(const LaserTurn& turn, multisense::LidarData& out);
  /// Null for a camera without an inertial unit.
  [[nodiscard]] HeadImu* imu() { return imu_ ? &*imu_ : nullptr; }
  /// Null for a camera without a laser.
  [[nodiscard]] const multisense::LidarCalibration* laser_calibration() const;

 private:
  void match_nothing(const CameraFault::Phantom& phantom);
  /// A weight of an object, which may be moved along it or removed.
  struct Weight {
    int object;
    std::string name;
  };
  [[nodiscard]] static Eigen::Isometry3d pose_of(const Weight& weight, const plant::Plant& plant);
  [[nodiscard]] static std::int64_t period_of(double rate_hz);
  void note_poses(const plant::Plant& plant, std::vector<Eigen::Isometry3d>& poses) const;

  const RobotModel& robot_;
  sensors::RayScene rays_;
  std::unique_ptr<sensors::StereoCamera> camera_;
  std::vector<float> disparity_;
  sensors::StereoImages images_;
  std::vector<int> robot_links_;  // those with visuals, in the order of their ray-scene bodies
  std::size_t object_count_;
  std::vector<Weight> weights_;
  int optical_link_;
  std::uint64_t seed_;
  std::atomic<std::int64_t> period_ns_;
  Time now_{}, next_{};
  std::optional<Laser> laser_;
  std::optional<HeadImu> imu_;
  std::atomic<double> spindle_rate_ = 0;
  CameraFault fault_;

  Exposure exposure_;
};

}  // namespace walkman
