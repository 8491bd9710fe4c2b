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

/// A force on a link of the robot for a while.
struct PushEvent {
  std::string link;
  Eigen::Vector3d force_W = Eigen::Vector3d::Zero();  ///< N
  Eigen::Vector3d p_LP = Eigen::Vector3d::Zero();     ///< where it acts, in the link's frame, m
  double duration = 0;                                ///< s
};

/// A weight of an object put on another place of it.
struct MoveWeightEvent {
  std::string object, weight;
  int link = 0;  ///< of the object
  Eigen::Isometry3d X_LA = Eigen::Isometry3d::Identity();
};

/// A weight taken off its object; it is gone from then on.
struct RemoveWeightEvent {
  std::string object, weight;
};

/// A force/torque sensor's readings are no longer what they should be. Channels: Fx, Fy, Fz in N, then Tx,
/// Ty, Tz in N·m.
struct SensorFaultEvent {
  std::string sensor;  ///< its frame
  /// Reading over what it should be; then the drift adds up, per s.
  Eigen::Matrix<double, 6, 6> matrix = Eigen::Matrix<double, 6, 6>::Identity();
  Eigen::Matrix<double, 6, 1> drift = Eigen::Matrix<double, 6, 1>::Zero();
  Eigen::Matrix<double, 6, 1> noise = Eigen::Matrix<double, 6, 1>::Zero();  ///< standard deviation, besides
  /// Where each channel ends, on either side of zero.
  Eigen::Matrix<double, 6, 1> end =
      Eigen::Matrix<double, 6, 1>::Constant(std::numeric_limits<double>::infinity());
  bool forces_stuck = false, torques_stuck = false;  ///< at what they read last
  /// A bit of a channel's integer on the wire.
  struct Bit {
    int channel = 0;
    int number = 0;             ///< 0 the lowest
    std::optional<bool> stuck;  ///< at that; else it is flipped
    double share = 1;           ///< of the samples in which it is
  };
  std::optional<Bit> bit;
};

/// The nth time that whoever commands the robot begins a phase of its task.
struct PhaseBegin {
  std::string phase;
  int occurrence = 1;
  double after = 0;  ///< s from then
};

/// Something that happens to the world by itself, at a time of the emulated clock, or when an onlooker sees
/// the robot begin something.
struct SceneEvent {
  double at = 0;      ///< s; without a phase
  std::string where;  ///< file:line of its description
  std::variant<PushEvent, MoveWeightEvent, RemoveWeightEvent, SensorFaultEvent> what;
  std::optional<PhaseBegin> phase = {};  ///< takes the place of the time
};

/// Reads `events` of a scene whose objects are `objects`. The result is in order of time, those of one time
/// in the file's order, those of phases last. Throws as `load_scene`; which links the robot has is not known
/// here.
[[nodiscard]] std::vector<SceneEvent> read_events(const std::vector<YamlMap>& maps,
                                                  const std::vector<SceneObject>& objects);

/// The keys an event may have, for YamlMap.
[[nodiscard]] const std::vector<std::string>& event_keys();

}  // namespace walkman
