#pragma once

#include <array>
#include <cstdint>

#include "drivers/canopen/remote_node.h"
#include "drivers/cia404/channel_sample.h"
#include "drivers/cia404/repeat_watch.h"

namespace walkman::cia404 {

/// Device type 1000h of an analogue input device: device profile 404, type 2.
inline constexpr std::uint32_t kAnalogueInputType = 0x00020194;

/// Data common to all samples of a measuring device, besides the values. One sample is all TPDOs of one SYNC.
struct MeasuringSample {
  std::uint16_t sample_counter = 0;  ///< 2050h:1; equal for all TPDOs of a sample
  std::uint8_t status = 0;           ///< 6150h:1: bit 0 invalid, 1 positive, 2 negative overload
  bool out_of_range = false;  ///< a channel is at the minimum or maximum of its 16 bits: no measurement
  Time age = Time::max();     ///< of the oldest of its frames, at the last `poll`
};

/// A sensor that sends its channels as process values (7130h) with a counter and a status, in the TPDOs to
/// which `settings.pdos` maps them. A derived class defines the number of channels and their meaning.
class MeasuringDevice : public canopen::RemoteNode {
 public:
  void poll(Time now) noexcept override;
  void clear_events() noexcept override;
  /// Whether a complete sample has arrived.
  [[nodiscard]] bool in_operation() const noexcept override { return channels_.at() != Time::min(); }
  [[nodiscard]] std::string_view error_text(std::uint16_t code) const noexcept override;

 protected:
  /// Throws std::runtime_error if the PDO mapping lacks what a sample needs (see `ChannelSample`).
  MeasuringDevice(const canopen::NodeSettings& settings, std::size_t channels);
  /// Call from the derived constructor. `extra`: steps of the configuration after supervision and before the
  /// PDOs.
  void set_measuring_steps(const std::vector<canopen::SdoStep>& extra);

  /// Factory mapping of a device whose first six channels are two vectors: TPDO1 7130h:1-3 and the sample
  /// counter 2050h:1, TPDO2 7130h:4-6 and the status 6150h:1, at every SYNC.
  [[nodiscard]] static canopen::DevicePdos vector_pdos();

  /// Called when a new sample is complete: converts `channels` to SI units. Counter, status and age are
  /// handled here. Returns true if the values are a measurement, false if they cannot be one.
  [[nodiscard]] virtual bool decode(const ChannelSample& channels) noexcept = 0;
  /// The derived class's sample; and its reset to initial values.
  [[nodiscard]] virtual MeasuringSample& newest() noexcept = 0;
  virtual void reset_sample() noexcept = 0;

 private:
  void on_tpdo(int number, const can::StampedFrame& frame) noexcept final;
  void on_begin_boot() noexcept final;
  [[nodiscard]] std::optional<canopen::FaultCause> judge_values(Time now) const noexcept final;
  [[nodiscard]] std::string what_samples_miss() const final;

  std::size_t count_;
  ChannelSample channels_;
  std::array<RepeatWatch, 2> vectors_;  // of the first six channels
  bool out_of_range_ = false;
};

}  // namespace walkman::cia404
