#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "emulator/scene/model_error.h"
#include "emulator/scene/scene_event.h"
#include "urdf/reader/robot_description.h"
#include "urdf/reader/robot_model.h"

namespace walkman {

class YamlMap;

/// How the robot's root link is supported.
enum class BaseKind {
  kFixed,     ///< held in space
  kFloating,  ///< nothing: the robot stands on its feet, or falls
  kHoisted,   ///< floating, with a slack rope from above that holds it when it falls
};

/// The rope of a hoisted robot, as on a lab's gantry: it pulls when taut and otherwise hangs slack.
struct HoistRope {
  std::string where;                    ///< file:line of its description; empty: none
  std::string link = "DWYTorso";        ///< robot link it is tied to, the chest
  Eigen::Vector3d p_LE = {0, 0, 0.15};  ///< where it is tied, in the link's frame, m
  std::optional<Eigen::Vector3d> p_WA;  ///< its upper end, m; unset: 1.5 m above the lower end at start
  std::optional<double> length;         ///< m; unset: distance between the ends at start plus 5 cm
};

/// A weight clamped to an object: a URDF of its own, fixed to one of the object's links.
struct AttachedWeight {
  std::string name;
  RobotModel model;
  int link = 0;                                            ///< of the object
  Eigen::Isometry3d X_LA = Eigen::Isometry3d::Identity();  ///< of its root link in that link's frame
};

/// A movable object of the scene.
struct SceneObject {
  std::string name;
  std::string where;  ///< file:line of its description
  RobotModel model;
  Eigen::Isometry3d X_WO = Eigen::Isometry3d::Identity();  ///< initial pose, W as below
  double left_end = 0;                                     ///< where it begins along its own x axis, m
  double length = 0;                                       ///< its extent along that axis, m
  std::vector<AttachedWeight> weights;

  /// Pose on the object's own x axis, `distance` (m) from its left end.
  [[nodiscard]] Eigen::Isometry3d X_OX(double distance) const;
  /// Pose of a weight's root link in the object's frame.
  [[nodiscard]] Eigen::Isometry3d X_OA(const AttachedWeight& weight) const;
  [[nodiscard]] double mass() const;  ///< with weights, kg
  /// Centre of mass with weights, in the object frame, m.
  [[nodiscard]] Eigen::Vector3d p_OOcm() const;
};

/// Spread of the object's pose over repetitions: each component is drawn uniformly from ± its value.
struct PoseJitter {
  double x = 0, y = 0;  ///< m
  double yaw = 0;       ///< rad
};

/// A fixed body of the scene (room, table), its root link's pose in W.
struct FixedBody {
  std::string name;
  std::string where;  ///< file:line of its description
  RobotModel model;
  Eigen::Isometry3d X_WF = Eigen::Isometry3d::Identity();
};

/// Initial state of an emulated world. W: origin on the ground below the robot's base_link, x forward, y
/// left, z up.
struct Scene {
  std::filesystem::path file;
  RobotDescription robot;
  ModelErrorChoice model_error;  ///< spread of the true robot around the nominal one
  bool camera_noise = true;      ///< false: the camera and its laser have no errors
  std::string posture;           ///< SRDF state the robot starts in
  BaseKind base = BaseKind::kFixed;
  HoistRope rope;                                          ///< of a hoisted base
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();  ///< pose of the robot's root link
  std::vector<FixedBody> fixed;
  std::vector<SceneObject> objects;
  PoseJitter jitter;
  std::uint64_t seed = 1;
  std::vector<SceneEvent> events;  ///< timed ones first, in order of time
  /// The method's parameters for this scene, for whoever runs it there; empty: its defaults.
  std::filesystem::path parameters;
};

/// Reads a scene file and the files it `extends`. Paths in a file are relative to it. Unknown keys, wrong
/// types, non-finite numbers and impossible weights (off the object) are errors. Throws std::runtime_error:
/// one sentence with file, line, key, what was found and what was expected. `packages`: where the meshes of
/// its bodies are looked up.
[[nodiscard]] Scene load_scene(const std::filesystem::path& yaml_file, const PackagePath& packages = {});

/// Reads a weight's place from `map`: `from_left_end_m`, on the object's x axis, or `xyz_m` on the object's
/// `link` (the root if not given), rotated by `rpy_rad` if given. Throws like `load_scene`.
void read_place(const YamlMap& map, const SceneObject& object, AttachedWeight& weight);

/// Draws the object poses of a repetition; deterministic in (scene, seed).
void apply_jitter(Scene& scene, std::uint64_t seed);

}  // namespace walkman
