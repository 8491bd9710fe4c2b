#pragma once

#include <deque>
#include <memory>
#include <vector>

#include <Eigen/Geometry>

#include "drivers/camera/multisense/messages.h"
#include "drivers/time.h"
#include "emulator/plant/plant.h"
#include "sensors/spinning_lidar.h"
#include "urdf/reader/robot_description.h"

namespace walkman {

/// One turn of the laser's mirror: where everything was during the turn, enough to cast its beams at any
/// later time.
struct LaserTurn {
  std::uint64_t number = 0;
  Time first{};  ///< of the first beam
  /// Pose of the link that carries the spindle, and spindle angle (rad), at `first` and each physics step
  /// after it.
  std::vector<Eigen::Isometry3d> X_WH;
  std::vector<double> angles;
  std::vector<Eigen::Isometry3d> poses;  ///< of the ray scene's movable bodies, halfway through
};
using LaserTurns = std::deque<std::shared_ptr<const LaserTurn>>;

/// The laser scanner on a camera's spindle: 40 turns of its mirror per second.
///
/// A turn only records where spindle and head are at each physics step; its beams are cast when they are
/// requested, each from between two of these steps.
class Laser {
 public:
  static constexpr std::size_t kKept = 256;  ///< turns: 6.4 s

  /// `camera_link`: the left optical frame, which calibrations refer to.
  Laser(const RobotModel& robot, const LaserParts& parts, int camera_link,
        const sensors::LidarOptions& options, std::uint64_t seed);

  /// Call after each physics step. Returns true when the bodies' poses are to be recorded by `halfway`.
  [[nodiscard]] bool advance(Time now, const plant::Plant& plant);
  void halfway(std::vector<Eigen::Isometry3d> poses) { turn_->poses = std::move(poses); }

  /// The latest complete turns.
  [[nodiscard]] const LaserTurns& turns() const { return turns_; }
  /// The spindle's angle at the last step, rad.
  [[nodiscard]] double angle() const { return angle_; }

  /// Casts a turn's beams into `scene`, whose bodies are at the poses recorded in the turn.
  void scan(const sensors::RayScene& scene, const LaserTurn& turn, multisense::LidarData& out);
  [[nodiscard]] const multisense::LidarCalibration& calibration() const { return calibration_; }

 private:
  [[nodiscard]] Eigen::Isometry3d X_WL(const LaserTurn& turn, double seconds) const;

  int carrier_, spindle_;            // link and joint of the robot
  Eigen::Isometry3d X_HSp_, X_SpL_;  // spindle at angle 0 on its carrier; laser on the spindle
  multisense::LidarCalibration calibration_;
  sensors::SpinningLidar lidar_;
  sensors::LidarScan scan_;
  std::shared_ptr<LaserTurn> turn_;  // in progress
  LaserTurns turns_;
  std::uint64_t number_ = 0;
  double angle_ = 0;
};

}  // namespace walkman
