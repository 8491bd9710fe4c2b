#pragma once

#include <array>
#include <optional>
#include <string>

#include <Eigen/Geometry>

#include "adaptation/motion/balance.h"
#include "adaptation/motion/kinematic_tree.h"
#include "adaptation/motion/stance.h"

namespace walkman::motion {

/// Whether what the ankles' sensors say of the ground can be true of a robot that stands: together they carry
/// what weighs on them, and the ground pushes either foot somewhere in its sole. By means over half a second,
/// in which a sway or a step of the load comes to nothing.
class FeetCheck {
 public:
  /// Of the weight: more than a hand can hold and less than one of the sensors being wrong by a third.
  static constexpr double kWeightTolerance = 120;  // N
  /// Of the ground force's place, beyond a sole's edge: cross-talk of 1 % of the range is 1 mm of it under
  /// half of the robot.
  static constexpr double kEdgeTolerance = 0.02;  // m

  /// `posed`: in any posture. A sole whose link (its parent's) has no collision geometry has no edge.
  FeetCheck(const KinematicTree& posed, const Stance& stance);

  /// The next reading, `dt` s after the last. Allocates nothing, throws nothing.
  void take(const KinematicTree& measured, const Stance& stance,
            const std::array<FootLoad, Stance::kFeet>& feet, double dt) noexcept;
  /// Begins anew: after cycles without a reading.
  void restart() noexcept { taken_for_ = 0; }

  /// One sentence about what cannot be; nothing in the first two seconds.
  [[nodiscard]] std::optional<std::string> contradiction(const KinematicTree& measured) const;

 private:
  struct Foot {
    Eigen::AlignedBox2d sole_F;  // empty: not known
    int sensor_link = -1;
    double force = 0;                                    // N, mean
    Eigen::Vector2d moment_F = Eigen::Vector2d::Zero();  // N·m: the force times its place, mean
  };

  std::array<Foot, Stance::kFeet> feet_;
  double feet_mass_ = 0;  // of what is below the sensors, kg
  double taken_for_ = 0;  // s
};

}  // namespace walkman::motion
