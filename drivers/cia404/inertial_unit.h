#pragma once

#include <cstdint>

#include <Eigen/Geometry>

#include "drivers/cia404/channel_sample.h"
#include "drivers/canopen/remote_node.h"

namespace walkman::imu {

/// Device type 1000h of an analogue input device: device profile 404, type 2.
inline constexpr std::uint32_t kInertialUnitType = 0x00020194;

/// One complete sample: all TPDOs of one SYNC, in the unit's own frame S.
struct InertialSample {
  Eigen::Vector3d specific_force = Eigen::Vector3d::Zero();    ///< m/s²: acceleration less gravity's
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< rad/s
  Eigen::Quaterniond R_WS = Eigen::Quaterniond::Identity();    ///< orientation, normalized
  std::uint16_t counter = 0;                                   ///< 2050h:1
  std::uint8_t status = 0;                                     ///< 6150h:1, bit 0 invalid
  bool out_of_range = false;  ///< a channel at an end of its 16 bits, or no unit quaternion: no measurement
  Time at = Time::min();      ///< of the oldest of the frames; `Time::min()` before the first sample
};

/// An inertial unit as a CiA 404 measuring device: 7130h:1-3 specific force in 0.001 m/s², 4-6 angular
/// velocity in 0.001 rad/s, 7-10 quaternion w, x, y, z in 1/30000 (docs/protocol.md). The only place where
/// its wire units meet SI units.
class InertialUnit final : public canopen::RemoteNode {
 public:
  static constexpr std::size_t kChannels = 10;

  /// Throws std::runtime_error when the PDO mapping lacks what a sample needs.
  explicit InertialUnit(const canopen::NodeSettings& settings);

  [[nodiscard]] const InertialSample& sample() const noexcept { return sample_; }
  [[nodiscard]] bool has_sample() const noexcept { return sample_.at != Time::min(); }

 private:
  void on_tpdo(int number, const can::StampedFrame& frame) noexcept override;
  void on_begin_boot() noexcept override;

  canopen::ChannelSample channels_;
  InertialSample sample_;
};

}  // namespace walkman::imu
