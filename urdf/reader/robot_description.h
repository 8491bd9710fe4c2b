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
  std::string posture;  ///< group_state of the SRDF that they tend to where nothing else matters
  std::vector<JointRange> ranges;
};

/// An arm that works, by the names of links in the URDF and of devices in the device table.
struct HandParts {
  std::string name;  ///< what people call it, such as "right"
  LimbParts arm;
  std::string shoulder;                             ///< link from which the arm's length counts
  std::string frame;                                ///< link whose frame is the hand frame H
  std::string motor;                                ///< hand drive
  std::string force_torque;                         ///< force/torque sensor at the wrist, its frame S
  std::map<std::string, double> continuous_torque;  ///< that a joint's motor can give for good, N·m
};

/// The sensors that tell whether a robot stands, by their names in the device table.
struct StanceParts {
  std::array<std::string, 2> feet;  ///< force/torque sensors, left and right
  std::string imu;
  std::string twist;  ///< joint that turns all that stands on the legs about the vertical; may be empty
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

/// What the robot's own computer knows of it beforehand (`urdf/walkman.robot.yaml`): files, and the names in
/// them that matter. Nothing of where the robot or anything else is.
struct RobotDescription {
  struct PdoLayoutFile {
    std::string name;
    std::filesystem::path file;
  };

  std::filesystem::path file;
  std::filesystem::path urdf, srdf, device_table, identities;
  std::vector<PdoLayoutFile> pdo_layouts;
  std::string pdo_layout;           ///< name of the one in use unless another is asked for
  std::vector<HandParts> hands;     ///< none: nothing can be grasped
  std::optional<LimbParts> torso;   ///< helps either arm; none: the arms work alone
  std::string optical_frame;        ///< of the camera: link with x right, y down, z forward
  std::optional<GazeParts> gaze;    ///< none: the camera looks where it looks
  std::optional<LaserParts> laser;  ///< none: the camera has no laser
  std::string camera_imu;           ///< link with the axes of the camera's inertial unit; empty: it has none
  std::optional<StanceParts> stance;  ///< none: the base is held

  /// `hands`. Throws std::runtime_error when there is none.
  [[nodiscard]] const std::vector<HandParts>& working_hands() const;
};

/// Reads the file; the files it names have to be there and are not opened. Throws std::runtime_error: one
/// sentence with file, line, key, what was found and what was expected.
[[nodiscard]] RobotDescription load_robot_description(const std::filesystem::path& yaml_file);

/// What of a described robot a command line may choose.
struct RobotChoice {
  PackagePath packages;  ///< where the URDF's meshes are looked up
  bool fd = false;       ///< CAN FD on every bus, whatever the device table says
};

/// A described robot with its files read, which have been checked against each other.
struct KnownRobot {
  RobotDescription description;
  RobotModel model;
  DeviceTable devices;

  /// Throws std::runtime_error as `load_robot_model` and `load_device_table` do, and for a part that the URDF
  /// does not have.
  explicit KnownRobot(RobotDescription robot, const RobotChoice& choice = {});
};

}  // namespace walkman
