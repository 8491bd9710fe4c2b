#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "urdf/reader/robot_model.h"
#include "urdf/reader/urdf_finding.h"

namespace walkman {

/// Role of a joint on a robot, judged from the URDF alone.
enum class JointRole {
  kBody,        ///< revolute or prismatic, with its own drive
  kHandMotor,   ///< the same, and other joints mimic it: one motor that pulls several joints
  kPassive,     ///< mimics another joint
  kContinuous,  ///< turns without limits, e.g. a laser's spindle
};

struct CheckedJoint {
  std::string name;
  JointRole role = JointRole::kBody;
  JointType type = JointType::kRevolute;
  JointLimits limits;  ///< lower and upper are meaningless for a continuous joint
};

enum class SensorKind { kForceTorque, kCamera, kImu, kLaser };

/// A frame that belongs to a sensor, according to its name or to a `<gazebo><sensor>` element.
struct CheckedSensor {
  SensorKind kind = SensorKind::kForceTorque;
  std::string frame;   ///< URDF link
  std::string parent;  ///< URDF link it is attached to; empty for the root
};

/// Contents of a URDF, and the parts of it that cannot be used.
struct ModelReport {
  std::filesystem::path file;
  std::string name;
  double total_mass = 0;  ///< kg
  int links = 0;
  int fixed_joints = 0;
  std::vector<CheckedJoint> joints;    ///< those that move, depth first
  std::vector<CheckedSensor> sensors;  ///< depth first
  std::vector<UrdfFinding> unusable;   ///< each with line, element and reason

  [[nodiscard]] int count(JointRole role) const;
};

/// Reads a URDF as `load_robot_model` does, but continues after parts it cannot use: a bad geometry or
/// inertia is left out, a joint that cannot move is treated as fixed, and all of these are listed. Throws
/// std::runtime_error if there is no model at all: no file, no XML, no tree.
[[nodiscard]] ModelReport check_model(const std::filesystem::path& urdf_file,
                                      const PackagePath& packages = {});

/// The report as text for users (SI units, several lines, each terminated) and as one JSON object (SI units).
[[nodiscard]] std::string to_text(const ModelReport& report);
[[nodiscard]] std::string to_json(const ModelReport& report);

}  // namespace walkman
