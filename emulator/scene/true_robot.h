#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "emulator/scene/model_error.h"
#include "urdf/reader/device_table.h"
#include "urdf/reader/robot_model.h"

namespace walkman {

/// What the emulated Earth pulls with where a model error has none of its own, m/s².
inline constexpr double kNominalGravity = 9.81;

/// How one joint's actuator and its drive's sensors differ from their class.
struct DriveErrors {
  double spring = 1;        ///< factor on the stiffness
  double friction = 1;      ///< factor on that of motor and gear
  double encoder_zero = 0;  ///< link encoder's reading less the true angle, rad
  double torque_zero = 0;   ///< reading of the unloaded spring, share of the peak torque
  /// Of the gear's transmission error over twice the motor's angle: sine and cosine, rad on the joint's side.
  std::array<double, 2> gear = {0, 0};
};

/// What of a robot differs from its model beside its links and joints.
struct RobotErrors {
  double gravity = 0;                         ///< less the nominal one, m/s²
  std::map<std::string, DriveErrors> drives;  ///< by joint; one that is not there has none
  /// Reading over load by force/torque frame: Fx Fy Fz in N, Tx Ty Tz in N·m, both ways. A frame that is not
  /// there has the matrix of its sensor kind.
  std::map<std::string, Eigen::Matrix<double, 6, 6>> force_torque_gains;

  [[nodiscard]] DriveErrors of_drive(const std::string& joint) const;
};

/// One draw: what, of which part, and the values in the unit of the kind.
struct ErrorDraw {
  ErrorKind kind = ErrorKind::kLinkMass;
  std::string of;
  std::vector<double> values;  ///< one, or one per axis

  [[nodiscard]] double size() const;  ///< its norm
};

/// The robot that the plant is, and how it came out of its model.
struct TrueRobot {
  RobotModel model;  ///< the same links and joints in the same order as in the nominal one
  RobotErrors errors;
  std::vector<ErrorDraw> draws;  ///< empty: it is the nominal robot to the bit
};

/// Draws the true robot around `nominal`: deterministic in (error, seed), each draw from a sequence of its
/// own. A kind without spread changes nothing. Masses, centres of mass and inertias are those of bodies that
/// can be, joints are joints of the device table's drives, `optical_frame` is the camera's. Throws
/// std::runtime_error when a weighed part is not in the robot, or a sensor's frame hangs on no fixed joint,
/// so that it has no mounting.
[[nodiscard]] TrueRobot draw_true_robot(const RobotModel& nominal, const DeviceTable& devices,
                                        const std::string& optical_frame, const ModelError& error,
                                        std::uint64_t seed);

}  // namespace walkman
