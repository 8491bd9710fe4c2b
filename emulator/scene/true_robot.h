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

/// Gravity of the emulated world if no model error changes it, m/s².
inline constexpr double kNominalGravity = 9.81;

/// How one joint's actuator and its drive's sensors differ from their class.
struct DriveErrors {
  double spring = 1;        ///< factor on the stiffness
  double friction = 1;      ///< factor on the friction of motor and gear
  double encoder_zero = 0;  ///< link encoder's reading minus the true angle, rad
  double torque_zero = 0;   ///< torque reading of the unloaded spring, share of the peak torque
  /// Gear transmission error at twice the motor's angle: sine and cosine amplitudes, rad on the joint side.
  std::array<double, 2> gear = {0, 0};
};

/// Differences of a robot from its model other than in its links and joints.
struct RobotErrors {
  double gravity = 0;                         ///< difference from the nominal gravity, m/s²
  std::map<std::string, DriveErrors> drives;  ///< by joint; a joint not listed has none
  /// Reading per load, by force/torque frame: Fx Fy Fz in N, Tx Ty Tz in N·m, for rows and columns. A frame
  /// not listed has the matrix of its sensor kind.
  std::map<std::string, Eigen::Matrix<double, 6, 6>> force_torque_gains;

  [[nodiscard]] DriveErrors of_drive(const std::string& joint) const;
};

/// One draw: its kind, the part it belongs to, and the values in the unit of the kind.
struct ErrorDraw {
  ErrorKind kind = ErrorKind::kLinkMass;
  std::string of;
  std::vector<double> values;  ///< one, or one per axis

  [[nodiscard]] double size() const;  ///< its norm
};

/// The robot that the plant simulates, and how it was derived from its model.
struct TrueRobot {
  RobotModel model;  ///< same links and joints, in the same order, as in the nominal one
  RobotErrors errors;
  std::vector<ErrorDraw> draws;  ///< empty: bit-identical to the nominal robot
};

/// Draws the true robot around `nominal`; deterministic in (error, seed), each draw from its own sequence. A
/// kind without spread changes nothing. Masses, centres of mass and inertias stay physically possible, joints
/// are those of the device table's drives, `optical_frame` is the camera's. Throws std::runtime_error if a
/// weighed part is not in the robot, or if a sensor's frame is not attached by a fixed joint and so has no
/// mounting.
[[nodiscard]] TrueRobot draw_true_robot(const RobotModel& nominal, const DeviceTable& devices,
                                        const std::string& optical_frame, const ModelError& error,
                                        std::uint64_t seed);

}  // namespace walkman
