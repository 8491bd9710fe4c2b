#pragma once

#include <map>
#include <string>

#include <Eigen/Geometry>

#include "emulator/scene/scene.h"
#include "emulator/scene/true_robot.h"

namespace walkman {

/// True joint values of a robot whose encoders read `read` (rad): a posture is defined by encoder readings,
/// because a robot uses them to take it up.
[[nodiscard]] std::map<std::string, double> true_posture(const std::map<std::string, double>& read,
                                                         const RobotErrors& errors);

/// Pose in W of the true robot's root link in the scene's posture: the mean position and orientation of its
/// soles match those of the nominal robot, and so does the height of their lowest point. Returns the scene's
/// own pose for a fixed base or a robot without feet.
[[nodiscard]] Eigen::Isometry3d standing_base(const Scene& scene, const RobotModel& nominal,
                                              const TrueRobot& truth, const DeviceTable& devices);

}  // namespace walkman
