#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "emulator/nodes/cia301/canopen_slave.h"
#include "emulator/nodes/measuring/analogue_channel.h"

namespace walkman::nodes {

/// A measuring device with analogue inputs (CiA 404, device type 00020194h): its channels, the sample counter
/// 2050h:1, and their combined status.
///
/// 6150h:1, which a TPDO carries, has the status bits of all channels; the other sub-indices have those of
/// their own channel. EMCY FF01h is present while a channel is over its range, FF02h while a channel that is
/// on has no finite reading.
class MeasuringNode : public CanopenSlave {
 public:
  [[nodiscard]] std::size_t channel_count() const noexcept { return channels_.size(); }

 protected:
  /// The adjustable channels, and those with a number of digits, must come first. Does not configure the
  /// PDOs.
  MeasuringNode(DeviceIdentity identity, std::span<const ChannelDescription> channels,
                std::uint32_t sample_period_us);

  /// Factory mapping for a device whose first six channels are two vectors: TPDO1 7130h:1-3 and the sample
  /// counter 2050h:1, TPDO2 7130h:4-6 and the status 6150h:1, at every SYNC.
  [[nodiscard]] static PdoSet vector_tpdos();

  /// Takes one sample: a reading per channel, SI units. Hot: called a thousand times a second.
  void take_sample(std::span<const double> readings) noexcept;
  void on_reset() noexcept override;

 private:
  std::vector<std::unique_ptr<AnalogueChannel>> channels_;
  Object<std::uint16_t> counter_;
};

/// 1000h for an analogue input device (CiA 404).
inline constexpr std::uint32_t kAnalogueInputType = 0x00020194;

}  // namespace walkman::nodes
