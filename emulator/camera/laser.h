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

/// One turn of the laser's mirror: where everything was meanwhile, enough to cast its beams at any later
/// time.
struct LaserTurn {
  std::uint64_t number = 0;
  Time first{};  ///< of the first beam
  /// Of what carries the spindle, and the spindle's angle (rad), at `first` and each physics step after it.
  std::vector<Eigen::Isometry3d> X_WH;
  std::vector<double> angles;
  std::vector<Eigen::Isometry3d> poses;  ///< of the ray scene's movable bodies, halfway
};
using LaserTurns = std::deque<std::shared_ptr<const LaserTurn>>;

/// The laser scanner on a camera's spindle: 40 turns of its mirror a second.
///
/// A turn only notes where spindle and head are at each physics step; its beams are cast when somebody asks
/// for them, each from between two of those.
class Laser {
 public:
  static constexpr std::size_t kKept = 256;  ///< turns: 6.4 s

  /// `camera_link`: the left optical frame, which calibrations refer to.
  Laser(const RobotModel& robot, const LaserParts& parts, int camera_link,
        const sensors::LidarOptions& options, std::uint64_t seed);

  /// After each physics step. True when the bodies' poses are to be noted by `halfway`.
  [[nodiscard]] bool advance(Time now, const plant::Plant& plant);
  void halfway(std::vector<Eigen::Isometry3d> poses) { turn_->poses = std::move(poses); }

  /// The last ones that are complete.
  [[nodiscard]] const LaserTurns& turns() const { return turns_; }
  /// The spindle's angle at the last step, rad.
  [[nodiscard]] double angle() const { return angle_; }

  /// Casts a turn's beams into `scene`, whose bodies are where the turn has them.
  void scan(const sensors::RayScene& scene, const LaserTurn& turn, multisense::LidarData& out);
  [[nodiscard]] const multisense::LidarCalibration& calibration() const { return calibration_; }

 private:
  [[nodiscard]] Eigen::Isometry3d X_WL(const LaserTurn& turn, double seconds) const;

  int carrier_, spindle_;            // link and joint of the robot
  Eigen::Isometry3d X_HSp_, X_SpL_;  // spindle at angle 0 on its carrier; laser on the spindle
  multisense::LidarCalibration calibration_;
  sensors::SpinningLidar lidar_;
  sensors::LidarScan scan_;
  std::shared_ptr<LaserTurn> turn_;  // under way
  LaserTurns turns_;
  std::uint64_t number_ = 0;
  double angle_ = 0;
};

}  // namespace walkman
