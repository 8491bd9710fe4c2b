#pragma once

#include "drivers/cia404/measuring_device.h"

namespace walkman::cia404 {

/// Newest complete sample of a load cell.
struct LoadCellSample : MeasuringSample {
  double force = 0;  ///< along the z axis of its frame, N
};

/// A single-axis load cell: one channel, 7130h:1 in 0.1 N.
class LoadCell final : public MeasuringDevice {
 public:
  static constexpr std::size_t kChannels = 1;

  /// Throws std::runtime_error if the PDO mapping lacks anything that a sample needs.
  explicit LoadCell(const canopen::NodeSettings& settings);

  [[nodiscard]] const LoadCellSample& sample() const noexcept { return sample_; }

  [[nodiscard]] static canopen::DevicePdos factory_pdos();

 private:
  [[nodiscard]] bool decode(const ChannelSample& channels) noexcept override;
  [[nodiscard]] MeasuringSample& newest() noexcept override { return sample_; }
  void reset_sample() noexcept override { sample_ = LoadCellSample{}; }

  LoadCellSample sample_;
};

}  // namespace walkman::cia404
