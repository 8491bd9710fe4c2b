#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <string>

#include "emulator/nodes/canopen_slave.h"
#include "urdf/wrench.h"

namespace walkman::nodes {

/// One channel of a force/torque sensor: full scale and effective resolution, in N or N m.
struct ChannelRating {
  double range = 0;
  double resolution = 0;
};

/// A six-axis force/torque sensor as built. The default ratings are those of IIT's 45 mm sensor (WALK-MAN's
/// own have not been published); channels Fx, Fy, Fz, Tx, Ty, Tz.
struct ForceTorqueParameters {
  std::uint8_t node_id = 0;
  std::string name;
  std::uint32_t serial = 0;
  std::array<ChannelRating, 6> channels{
      {{1500, 0.25}, {1500, 0.25}, {2000, 0.25}, {35, 0.005}, {35, 0.005}, {25, 0.004}}};
  std::uint32_t sample_period_us = 1000;  ///< 6114h
  double noise = 0;                       ///< standard deviation of a sample, in resolutions of its channel
  std::array<double, 6> residual{};       ///< what the unloaded sensor reads, N or N m
  std::uint64_t noise_seed = 0;
};

/// A six-axis force/torque sensor (CiA 404, device type 00020194h). Sub-index = channel, Fx Fy Fz Tx Ty Tz.
///
/// A sample goes through residual, noise, range, resolution, filter and tare: 6100h is the field value before
/// the tare, 6130h (real32, N and N m) and 7130h (0.1 N, 0.01 N m) the process value after it. Filter 61A0h:
/// 0 none (factory setting), 1 first-order low-pass with the time constant 61A1h in ms. Tare: 6138h, or the
/// present field value by writing "tara" to 6139h. 6150h: bit 0 invalid, 1 positive, 2 negative overload; sub
/// 1, which the TPDO carries, also has the bits of all other channels. TPDO1: 7130h:1-3 and the sample
/// counter 2050h:1; TPDO2: 7130h:4-6 and 6150h:1; every SYNC.
class ForceTorqueNode : public CanopenSlave {
 public:
  static constexpr std::size_t kChannels = 6;

  explicit ForceTorqueNode(const ForceTorqueParameters& parameters);

  /// Takes one sample: the load on the sensor, about and in the sensor frame S. To be called every sample
  /// period. A value that is not finite makes its channel invalid; its last value stays.
  void sample(const Wrench& F_So_S) noexcept;

 protected:
  void on_reset() noexcept override;

 private:
  struct Channel {
    ChannelRating rating;
    double unit = 0;  // of the i16 process value
    Object<float> field_value, process_value, tare;
    Object<std::int16_t> process_value_i16;
    Object<std::uint8_t> operating_mode, status, filter_type;
    Object<std::uint16_t> filter_constant;
    double filtered = 0;
    bool settled = false;  // the filter has a value to start from
  };

  void add_channel(std::size_t i);
  [[nodiscard]] std::uint8_t sample_channel(Channel& channel, double load) noexcept;
  void publish_process_value(Channel& channel, double tare) noexcept;

  ForceTorqueParameters parameters_;
  std::array<Channel, kChannels> channels_;
  Object<std::uint16_t> counter_;
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

}  // namespace walkman::nodes
