#pragma once

#include <array>
#include <cstdint>

#include "drivers/cia404/measuring_device.h"
#include "urdf/reader/wrench.h"

namespace walkman::cia404 {

/// Newest complete sample of a force/torque sensor.
struct ForceTorqueSample : MeasuringSample {
  Wrench F_So_S;  ///< load on the sensor, about the origin of sensor frame S and expressed in S; N, N·m
};

/// One six-axis force/torque sensor (CiA 404): channels 1-6 are Fx, Fy, Fz, Tx, Ty, Tz, process values as i16
/// with the number of decimal digits given in 6132h. The only place where its wire units are converted to SI
/// units.
class ForceTorqueSensor final : public MeasuringDevice {
 public:
  static constexpr std::size_t kChannels = 6;

  /// Throws std::runtime_error if the PDO mapping lacks what a sample needs.
  explicit ForceTorqueSensor(const canopen::NodeSettings& settings);

  [[nodiscard]] const ForceTorqueSample& sample() const noexcept { return sample_; }

  /// Its factory mapping, layout A of docs/protocol.md.
  [[nodiscard]] static canopen::DevicePdos factory_pdos() { return vector_pdos(); }

 private:
  [[nodiscard]] bool decode(const ChannelSample& channels) noexcept override;
  [[nodiscard]] MeasuringSample& newest() noexcept override { return sample_; }
  void reset_sample() noexcept override { sample_ = ForceTorqueSample{}; }

  std::array<std::uint32_t, kChannels> digits_{};  // 6132h
  ForceTorqueSample sample_;
};

}  // namespace walkman::cia404
