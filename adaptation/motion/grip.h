#pragma once

#include <string>
#include <vector>

#include "adaptation/motion/body_shape.h"

namespace walkman::motion {

/// How the fingers of an underactuated hand lie around a handle, by the geometry of its URDF: the tendon
/// closes every joint until its phalanx meets the handle, or the joint its stop.
class Grip {
 public:
  /// A phalanx in the hand frame H.
  struct Phalanx {
    int link = 0;
    Eigen::Isometry3d X_HL = Eigen::Isometry3d::Identity();
  };

  /// How deep a handle lies in the palm's pad under the full grip, m.
  static constexpr double kDepth = 0.0075;

  /// z in H of the axis of a bar of `radius` (m) that a hand has closed on, lifted and turned: the thicker it
  /// is, the farther the thumb pushes it from the wrist.
  static constexpr double seat(double radius) { return 0.4 * (0.036 - radius); }
  /// Standard deviation of that, m, for it depends on friction.
  static constexpr double kSeatDeviation = 0.0016;
  /// Stiffness with which a closed hand holds a bar, in its softest direction, N/m.
  static constexpr double kFirmness = 18000;

  /// `hand_link` carries H: x along the handle, y against the palm, origin on the palm. The fingers are what
  /// moves with `motor`. Keeps a reference to `model`. Throws std::out_of_range for names that the model does
  /// not have.
  Grip(const RobotModel& model, const std::string& hand_link, const std::string& motor);

  /// Around a cylinder of `radius` (m) that lies on the palm.
  [[nodiscard]] std::vector<Phalanx> around(double radius) const;

 private:
  struct Finger {
    int joint = 0, link = 0;
    int parent = -1;              // phalanx that carries it, −1: the palm
    Eigen::Isometry3d X_PJ;       // in that one, or in H
    double open = 0, closed = 0;  // rad
    std::vector<BodyShape> shapes;
  };
  const RobotModel& model_;
  std::vector<Finger> fingers_;  // parents before their children
};

}  // namespace walkman::motion
