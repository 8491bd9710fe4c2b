#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <string>

#include <Eigen/Geometry>

#include "emulator/nodes/measuring/measuring_node.h"

namespace walkman::nodes {

/// 6110h for a component of the orientation's unit quaternion, in the manufacturer-specific range; 1.0 is
/// 30000 counts.
inline constexpr std::uint16_t kOrientationSensor = 10601;
inline constexpr double kQuaternionUnit = 1.0 / 30000;

/// Hardware of an inertial unit. WALK-MAN's own is not documented; the numbers are estimates for MEMS
/// attitude sensors of its class.
struct InertialParameters {
  std::uint8_t node_id = 0;
  std::string name;
  std::uint32_t serial = 0;
  double force_range = 32;                ///< of the specific force, m/s²
  double rate_range = 32;                 ///< of the angular velocity, rad/s
  std::uint32_t sample_period_us = 1000;  ///< 6114h
  double force_noise = 0;                 ///< standard deviation of a sample, m/s²
  double rate_noise = 0;                  ///< rad/s
  std::array<double, 3> force_bias{};     ///< m/s²
  std::array<double, 3> rate_bias{};      ///< rad/s
  std::array<double, 2> tilt_error{};     ///< of the orientation about the world's x and y, rad
  double yaw_drift = 0;                   ///< of the orientation about the vertical, rad/s
  std::uint64_t noise_seed = 0;
};

/// Quantities that an inertial unit with frame S measures.
struct InertialReadings {
  Eigen::Vector3d specific_force_S = Eigen::Vector3d::Zero();    ///< of So: acceleration minus gravity, m/s²
  Eigen::Vector3d angular_velocity_S = Eigen::Vector3d::Zero();  ///< of S in the world, rad/s
  Eigen::Quaterniond q_WS = Eigen::Quaterniond::Identity();      ///< S in the world
};

/// An inertial unit (CiA 404, device type 00020194h). Channels 1-3 specific force, 4-6 angular velocity, 7-10
/// orientation as the unit quaternion w, x, y, z with w >= 0 that rotates vectors from S to the world, up to
/// a slowly drifting angle about the vertical. 7130h and 9130h in 0.001 m/s², 0.001 rad/s and 1/30000.
///
/// TPDO1: 7130h:1-3 and the sample counter 2050h:1; TPDO2: 7130h:4-6 and the status 6150h:1; TPDO3:
/// 7130h:7-10; every SYNC.
class InertialNode : public MeasuringNode {
 public:
  static constexpr std::size_t kChannels = 10;

  explicit InertialNode(const InertialParameters& parameters);

  /// Takes one sample. To be called every sample period. A value that is not finite makes its channel
  /// invalid.
  void sample(const InertialReadings& readings) noexcept;

 protected:
  void on_reset() noexcept override;

 private:
  [[nodiscard]] Eigen::Quaterniond estimate(const Eigen::Quaterniond& q_WS) const noexcept;

  InertialParameters parameters_;
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
  double yaw_error_ = 0;  // rad
};

}  // namespace walkman::nodes
