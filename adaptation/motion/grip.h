#pragma once

#include <string>
#include <vector>

#include "adaptation/motion/body_shape.h"

namespace walkman::motion {

/// Finger poses of an underactuated hand around a handle, from the geometry of its URDF: the tendon closes
/// every joint until its phalanx meets the handle or the joint reaches its stop.
class Grip {
 public:
  /// A phalanx in the hand frame H.
  struct Phalanx {
    int link = 0;
    Eigen::Isometry3d X_HL = Eigen::Isometry3d::Identity();
  };

  /// Depth to which a handle sinks into the palm's pad under full grip, m.
  static constexpr double kDepth = 0.0075;

  /// z in H of the axis of a bar of `radius` (m) after a hand has closed on it, lifted and turned: the
  /// thicker the bar, the farther the thumb pushes it from the wrist.
  static constexpr double seat(double radius) { return 0.4 * (0.036 - radius); }
  /// Standard deviation of the seat, m: it depends on friction.
  static constexpr double kSeatDeviation = 0.0016;
  /// Stiffness with which a closed hand holds a bar, in its softest direction, N/m.
  static constexpr double kFirmness = 18000;

  /// `hand_link` is the link of frame H: x along the handle, y against the palm, origin on the palm. The
  /// fingers are the links that move with `motor`. Keeps a reference to `model`. Throws std::out_of_range for
  /// names that the model does not have.
  Grip(const RobotModel& model, const std::string& hand_link, const std::string& motor);

  /// Returns the phalanges around a cylinder of `radius` (m) that lies on the palm.
  [[nodiscard]] std::vector<Phalanx> around(double radius) const;

 private:
  struct Finger {
    int joint = 0, link = 0;
    int parent = -1;              // index of the phalanx that carries it, −1: the palm
    Eigen::Isometry3d X_PJ;       // in that phalanx, or in H
    double open = 0, closed = 0;  // rad
    std::vector<BodyShape> shapes;
  };
  const RobotModel& model_;
  std::vector<Finger> fingers_;  // parents before their children
};

}  // namespace walkman::motion
