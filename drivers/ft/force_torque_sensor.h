#pragma once

#include <array>
#include <cstdint>

#include "drivers/canopen/remote_node.h"
#include "urdf/wrench.h"

namespace walkman::ft {

/// Device type 1000h of an analogue input device: device profile 404, type 2.
inline constexpr std::uint32_t kForceTorqueType = 0x00020194;

enum class TareState { kIdle, kBusy, kDone, kFailed };

/// One complete sample: both TPDOs of one SYNC.
struct ForceTorqueSample {
  Wrench F_So_S;              ///< load on the sensor, about and in the sensor frame
  std::uint16_t counter = 0;  ///< 2050h:1
  std::uint8_t status = 0;    ///< 6150h:1, bit 0 invalid, 1 positive, 2 negative overload
  bool out_of_range = false;  ///< a channel at an end of its 16 bits: no measurement
  Time at = Time::min();      ///< of the older of the two frames; `Time::min()` before the first sample
};

/// One six-axis force/torque sensor (CiA 404): channels 1-6 are Fx, Fy, Fz, Tx, Ty, Tz, process values as i16
/// with the number of decimal digits of 6132h. TPDO1 carries the forces and the sample counter, TPDO2 the
/// torques and the status (docs/protocol.md). The only place where its wire units meet SI units.
class ForceTorqueSensor final : public canopen::RemoteNode {
 public:
  static constexpr std::size_t kChannels = 6;

  explicit ForceTorqueSensor(const canopen::NodeSettings& settings);

  /// The newest complete sample. A TPDO2 completes the TPDO1 before it only when both left the sensor with
  /// the same SYNC (less than a cycle apart), and only when the sample counter has moved on since the last
  /// sample.
  [[nodiscard]] const ForceTorqueSample& sample() const noexcept { return sample_; }
  [[nodiscard]] bool has_sample() const noexcept { return sample_.at != Time::min(); }

  [[nodiscard]] Time tpdo1_at() const noexcept { return tpdo1_at_; }
  [[nodiscard]] Time tpdo2_at() const noexcept { return tpdo2_at_; }
  /// TPDOs that found no partner, or a sample counter that stood still.
  [[nodiscard]] std::uint64_t unpaired() const noexcept { return unpaired_; }

  /// Asks the sensor to take its present load as zero: "tara" to 6139h of every channel, in the background.
  /// Ignored while a tare is under way.
  void tare() noexcept;
  [[nodiscard]] TareState tare_state() const noexcept { return tare_state_; }

  void poll(Time now) noexcept override;

 private:
  bool on_tpdo(int number, const can::StampedFrame& frame) noexcept override;
  void on_begin_boot() noexcept override;
  void complete(const can::StampedFrame& tpdo2) noexcept;
  [[nodiscard]] static std::vector<canopen::SdoStep> configuration_of(const canopen::NodeSettings& settings,
                                                                      ForceTorqueSensor& sensor);

  std::array<std::uint32_t, kChannels> digits_{};  // 6132h
  ForceTorqueSample sample_;
  std::array<std::int16_t, 3> force_raw_{};  // of the TPDO1 that waits for its TPDO2
  std::uint16_t waiting_counter_ = 0;
  bool waiting_ = false;
  Time tpdo1_at_ = Time::min();
  Time tpdo2_at_ = Time::min();
  std::uint64_t unpaired_ = 0;

  TareState tare_state_ = TareState::kIdle;
  std::uint8_t tare_channel_ = 0;  // 1..6 while busy
};

}  // namespace walkman::ft
