#pragma once

#include <cstdint>
#include <filesystem>

#include <Eigen/Core>

#include "emulator/nodes/measuring/force_torque_node.h"

namespace walkman {

/// A kind of six-axis force/torque sensor: its ratings, and how far sensors of this kind differ from an ideal
/// one. The errors of an individual sensor are drawn from the latter.
struct ForceTorqueKind {
  Eigen::Vector3d force_range, torque_range;            ///< N, N·m
  Eigen::Vector3d force_resolution, torque_resolution;  ///< N, N·m
  double noise = 0;                                     ///< standard deviation of a reading, unit: resolution
  double force_bias = 0, torque_bias = 0;               ///< largest reading of the unloaded sensor, N, N·m
  double cross_talk = 0;    ///< largest reading of an axis due to another at its range, share of the range
  double ambient_c = 25;    ///< °C
  double warm_up = 0;       ///< K above the air, when warm
  double warm_up_time = 1;  ///< s, time constant
  double drift = 0;         ///< largest drift of the zero, share of the range per kelvin
  double low_pass_hz = 0;   ///< corner of the amplifier's filter; 0: none
};

/// Reads a kind from its YAML file. Throws std::runtime_error with file, line and key.
[[nodiscard]] ForceTorqueKind load_force_torque_kind(const std::filesystem::path& file);

/// Which errors an emulated force/torque sensor has.
enum class SensorErrors {
  kNone,                ///< exact readings: no resolution and no range limit either
  kNoiseAndResolution,  ///< of each reading, within the range; gains and zero are exact
  kAll,
};

/// One sensor of a kind, with its individual errors drawn from `seed` and `node_id`.
[[nodiscard]] nodes::ForceTorqueParameters draw_sensor(const ForceTorqueKind& kind, SensorErrors errors,
                                                       std::uint64_t seed, std::uint8_t node_id);

}  // namespace walkman
