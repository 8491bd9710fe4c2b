#pragma once

#include <array>
#include <optional>
#include <string>

#include <Eigen/Geometry>

#include "adaptation/motion/balance.h"
#include "adaptation/motion/kinematic_tree.h"
#include "adaptation/motion/stance.h"

namespace walkman::motion {

/// Checks whether what the ankle sensors measure of the ground is possible for a standing robot: together
/// they carry the weight above them, and the ground pushes on each foot within its sole. Uses means over half
/// a second, in which sway and load steps average out.
class FeetCheck {
 public:
  /// On the weight: more than a hand can hold, and less than an error of one sensor by a third.
  static constexpr double kWeightTolerance = 120;  // N
  /// On the point of application of the ground force, beyond a sole's edge: cross-talk of 1 % of the range
  /// moves it by 1 mm under half of the robot.
  static constexpr double kEdgeTolerance = 0.02;  // m

  /// `posed`: in any posture. A sole has no edge if the link that it is fixed to has no collision geometry.
  FeetCheck(const KinematicTree& posed, const Stance& stance);

  /// Processes the next reading, `dt` s after the last. Neither allocates nor throws.
  void take(const KinematicTree& measured, const Stance& stance,
            const std::array<FootLoad, Stance::kFeet>& feet, double dt) noexcept;
  /// Call after cycles without a reading: restarts the means.
  void restart() noexcept { taken_for_ = 0; }

  /// Returns one sentence about what is impossible; std::nullopt in the first two seconds.
  [[nodiscard]] std::optional<std::string> contradiction(const KinematicTree& measured) const;

 private:
  struct Foot {
    Eigen::AlignedBox2d sole_F;  // empty: unknown
    int sensor_link = -1;
    double force = 0;                                    // N, mean
    Eigen::Vector2d moment_F = Eigen::Vector2d::Zero();  // N·m: force times its point of application, mean
  };

  std::array<Foot, Stance::kFeet> feet_;
  double feet_mass_ = 0;  // of the links below the sensors, kg
  double taken_for_ = 0;  // s
};

}  // namespace walkman::motion
