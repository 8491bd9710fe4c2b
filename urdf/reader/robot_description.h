#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "urdf/reader/device_table.h"
#include "urdf/reader/robot_model.h"

namespace walkman {

/// Bounds of a joint narrower than the URDF's, rad.
struct JointRange {
  std::string joint;
  double lower = 0, upper = 0;
};

/// Joints that work together.
struct LimbParts {
  std::vector<std::string> joints;
  std::string posture;  ///< group_state of the SRDF towards which they tend if nothing else matters
  std::vector<JointRange> ranges;
};

/// A working arm, given by the names of links in the URDF and of devices in the device table.
struct HandParts {
  std::string name;  ///< name for users, such as "right"
  LimbParts arm;
  std::string shoulder;                             ///< link from which the arm's length is measured
  std::string frame;                                ///< link whose frame is the hand frame H
  std::string motor;                                ///< hand drive
  std::string force_torque;                         ///< force/torque sensor at the wrist, its frame S
  std::map<std::string, double> continuous_torque;  ///< torque that each joint's motor can sustain, N·m
};

/// The sensors that show whether a robot is standing, by their names in the device table.
struct StanceParts {
  std::array<std::string, 2> feet;  ///< force/torque sensors, left and right
  std::string imu;
  std::string twist;  ///< joint that turns everything above the legs about the vertical; may be empty
};

/// The joints that turn the camera.
struct GazeParts {
  std::string pan, tilt;
};

/// The camera's laser scanner.
struct LaserParts {
  std::string frame;    ///< link with x along the middle beam, z the axis of the mirror
  std::string spindle;  ///< joint that turns it
};

/// Prior knowledge of the robot's own computer about it (`urdf/walkman.robot.yaml`): files, and the relevant
/// names in them. Nothing about where the robot or anything else is.
struct RobotDescription {
  struct PdoLayoutFile {
    std::string name;
    std::filesystem::path file;
  };

  std::filesystem::path file;
  std::filesystem::path urdf, srdf, device_table, identities;
  std::vector<PdoLayoutFile> pdo_layouts;
  std::string pdo_layout;           ///< name of the one in use unless another is selected
  std::vector<HandParts> hands;     ///< none: nothing can be grasped
  std::optional<LimbParts> torso;   ///< helps either arm; none: the arms work alone
  std::string optical_frame;        ///< of the camera: link with x right, y down, z forward
  std::optional<GazeParts> gaze;    ///< none: the camera cannot be turned
  std::optional<LaserParts> laser;  ///< none: the camera has no laser
  std::string camera_imu;           ///< link with the axes of the camera's inertial unit; empty: it has none
  std::optional<StanceParts> stance;  ///< none: the base is held

  /// Returns `hands`. Throws std::runtime_error if there is none.
  [[nodiscard]] const std::vector<HandParts>& working_hands() const;
};

/// Reads the file; the files it names must exist but are not opened. Throws std::runtime_error (one sentence)
/// with file, line, key, the value found and what was expected.
[[nodiscard]] RobotDescription load_robot_description(const std::filesystem::path& yaml_file);

/// Options of a described robot that a command line may select.
struct RobotChoice {
  PackagePath packages;  ///< where the URDF's meshes are looked up
  bool fd = false;       ///< CAN FD on every bus, regardless of the device table
};

/// A described robot with its files read and checked against each other.
struct KnownRobot {
  RobotDescription description;
  RobotModel model;
  DeviceTable devices;

  /// Throws std::runtime_error as `load_robot_model` and `load_device_table` do, and if the URDF lacks one of
  /// the parts.
  explicit KnownRobot(RobotDescription robot, const RobotChoice& choice = {});
};

}  // namespace walkman
