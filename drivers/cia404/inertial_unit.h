#pragma once

#include <Eigen/Geometry>

#include "drivers/cia404/measuring_device.h"

namespace walkman::cia404 {

/// Newest complete sample of an inertial unit, in its own frame S.
struct InertialSample : MeasuringSample {
  /// In S, m/s²: acceleration minus gravity; +9.81 upwards at rest.
  Eigen::Vector3d specific_force = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< in S, rad/s
  /// Rotates vectors from S into the world; normalized. Its angle about the vertical drifts.
  Eigen::Quaterniond R_WS = Eigen::Quaterniond::Identity();
};

/// An inertial unit as a CiA 404 measuring device: 7130h:1-3 specific force in 0.001 m/s², 4-6 angular
/// velocity in 0.001 rad/s, 7-10 quaternion w, x, y, z in 1/30000 (docs/protocol.md). The only place where
/// its wire units are converted to SI units. A quaternion that is not of unit length is out of range.
class InertialUnit final : public MeasuringDevice {
 public:
  static constexpr std::size_t kChannels = 10;

  /// Throws std::runtime_error if the PDO mapping lacks what a sample needs.
  explicit InertialUnit(const canopen::NodeSettings& settings);

  [[nodiscard]] const InertialSample& sample() const noexcept { return sample_; }

  /// Its factory mapping, layout A of docs/protocol.md.
  [[nodiscard]] static canopen::DevicePdos factory_pdos();

 private:
  [[nodiscard]] bool decode(const ChannelSample& channels) noexcept override;
  [[nodiscard]] MeasuringSample& newest() noexcept override { return sample_; }
  void reset_sample() noexcept override { sample_ = InertialSample{}; }

  InertialSample sample_;
};

}  // namespace walkman::cia404
