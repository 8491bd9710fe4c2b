#pragma once

#include <array>
#include <cstdint>

#include "drivers/cia404/channel_sample.h"
#include "drivers/canopen/remote_node.h"
#include "urdf/reader/wrench.h"

namespace walkman::ft {

/// Device type 1000h of an analogue input device: device profile 404, type 2.
inline constexpr std::uint32_t kForceTorqueType = 0x00020194;

enum class TareState { kIdle, kBusy, kDone, kFailed };

/// One complete sample: all TPDOs of one SYNC.
struct ForceTorqueSample {
  Wrench F_So_S;              ///< load on the sensor, about and in the sensor frame
  std::uint16_t counter = 0;  ///< 2050h:1
  std::uint8_t status = 0;    ///< 6150h:1, bit 0 invalid, 1 positive, 2 negative overload
  bool out_of_range = false;  ///< a channel at an end of its 16 bits: no measurement
  Time at = Time::min();      ///< of the oldest of the frames; `Time::min()` before the first sample
};

/// One six-axis force/torque sensor (CiA 404): channels 1-6 are Fx, Fy, Fz, Tx, Ty, Tz, process values as i16
/// with the number of decimal digits of 6132h, in the TPDOs that `settings.pdos` map them to. The only place
/// where its wire units meet SI units.
class ForceTorqueSensor final : public canopen::RemoteNode {
 public:
  static constexpr std::size_t kChannels = 6;

  /// Throws std::runtime_error when the PDO mapping lacks what a sample needs.
  explicit ForceTorqueSensor(const canopen::NodeSettings& settings);

  /// The newest complete sample; see `ChannelSample` for what makes one.
  [[nodiscard]] const ForceTorqueSample& sample() const noexcept { return sample_; }
  [[nodiscard]] bool has_sample() const noexcept { return sample_.at != Time::min(); }

  /// TPDOs that found no partner, or a sample counter that stood still.
  [[nodiscard]] std::uint64_t unpaired() const noexcept { return channels_.unpaired(); }

  /// Asks the sensor to take its present load as zero: "tara" to 6139h of every channel, in the background.
  /// Ignored while a tare is under way.
  void tare() noexcept;
  [[nodiscard]] TareState tare_state() const noexcept { return tare_state_; }

  void poll(Time now) noexcept override;

 private:
  void on_tpdo(int number, const can::StampedFrame& frame) noexcept override;
  void on_begin_boot() noexcept override;
  [[nodiscard]] std::vector<canopen::SdoStep> configuration_of(const canopen::NodeSettings& settings);

  std::array<std::uint32_t, kChannels> digits_{};  // 6132h
  canopen::ChannelSample channels_;
  ForceTorqueSample sample_;

  TareState tare_state_ = TareState::kIdle;
  std::uint8_t tare_channel_ = 0;  // 1..6 while busy
};

}  // namespace walkman::ft
