#pragma once

#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Geometry>

namespace walkman {

class YamlMap;
struct SceneObject;

/// A force on a link of the robot for a limited time.
struct PushEvent {
  std::string link;
  Eigen::Vector3d force_W = Eigen::Vector3d::Zero();  ///< N
  Eigen::Vector3d p_LP = Eigen::Vector3d::Zero();     ///< where it acts, in the link's frame, m
  double duration = 0;                                ///< s
};

/// A weight of an object moved to another place on it.
struct MoveWeightEvent {
  std::string object, weight;
  int link = 0;  ///< of the object
  Eigen::Isometry3d X_LA = Eigen::Isometry3d::Identity();
};

/// A weight removed from its object; it no longer exists afterwards.
struct RemoveWeightEvent {
  std::string object, weight;
};

/// A fault of a force/torque sensor's readings. Channels: Fx, Fy, Fz in N, then Tx, Ty, Tz in N·m.
struct SensorFaultEvent {
  std::string sensor;  ///< its frame
  /// Maps the correct reading to the faulty one; the drift, per s, then accumulates.
  Eigen::Matrix<double, 6, 6> matrix = Eigen::Matrix<double, 6, 6>::Identity();
  Eigen::Matrix<double, 6, 1> drift = Eigen::Matrix<double, 6, 1>::Zero();
  Eigen::Matrix<double, 6, 1> noise = Eigen::Matrix<double, 6, 1>::Zero();  ///< standard deviation, added
  /// Saturation limit of each channel, on either side of zero.
  Eigen::Matrix<double, 6, 1> end =
      Eigen::Matrix<double, 6, 1>::Constant(std::numeric_limits<double>::infinity());
  bool forces_stuck = false, torques_stuck = false;  ///< at their last readings
  /// A faulty bit of a channel's integer on the wire.
  struct Bit {
    int channel = 0;
    int number = 0;             ///< 0: the lowest
    std::optional<bool> stuck;  ///< at this value; unset: it is flipped
    double share = 1;           ///< share of the samples affected
  };
  std::optional<Bit> bit;
};

/// The nth time that whoever commands the robot begins a phase of its task.
struct PhaseBegin {
  std::string phase;
  int occurrence = 1;
  double after = 0;  ///< s after that
};

/// Something that happens to the world by itself, at a time of the emulated clock or when an onlooker sees
/// the robot begin a phase.
struct SceneEvent {
  double at = 0;      ///< s; unused with a phase
  std::string where;  ///< file:line of its description
  std::variant<PushEvent, MoveWeightEvent, RemoveWeightEvent, SensorFaultEvent> what;
  std::optional<PhaseBegin> phase = {};  ///< replaces the time
};

/// Reads the `events` of a scene whose objects are `objects`. The result is in order of time, events at the
/// same time in the file's order, events of phases last. Throws like `load_scene`; does not check the robot's
/// links, which are not known here.
[[nodiscard]] std::vector<SceneEvent> read_events(const std::vector<YamlMap>& maps,
                                                  const std::vector<SceneObject>& objects);

/// The keys an event may have, for YamlMap.
[[nodiscard]] const std::vector<std::string>& event_keys();

}  // namespace walkman
