#pragma once

#include <map>
#include <string>

#include <Eigen/Geometry>

#include "emulator/scene/scene.h"
#include "emulator/scene/true_robot.h"

namespace walkman {

/// True joint values of a robot whose encoders read `read` (rad): a posture is what the encoders say, since a
/// robot takes it up by them.
[[nodiscard]] std::map<std::string, double> true_posture(const std::map<std::string, double>& read,
                                                         const RobotErrors& errors);

/// Where the root link of the true robot stands in W in the scene's posture: its soles lie, in the mean of
/// position and direction, where those of the nominal robot would, and their lowest point as low. The scene's
/// own pose for a held base, or a robot without feet.
[[nodiscard]] Eigen::Isometry3d standing_base(const Scene& scene, const RobotModel& nominal,
                                              const TrueRobot& truth, const DeviceTable& devices);

}  // namespace walkman
