#pragma once

#include <array>
#include <cstdint>
#include <random>

#include <Eigen/Core>

#include "urdf/reader/wrench.h"

namespace walkman::nodes {

using Vector6 = Eigen::Matrix<double, 6, 1>;  ///< Fx, Fy, Fz in N, then Tx, Ty, Tz in N·m
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// How one force/torque sensor alters its load before the converter reads it. By default not at all: every
/// stage is off.
struct TransducerParameters {
  Matrix6 cross_talk = Matrix6::Identity();    ///< reading = cross_talk * load; off: identity
  double ambient_c = 25;                       ///< of the air and of the sensor when it is switched on, degC
  double warm_up = 0;                          ///< final rise above the air, K; off: 0
  double warm_up_time = 1;                     ///< its time constant, s
  Vector6 drift_per_kelvin = Vector6::Zero();  ///< drift of the zero, N/K and N·m/K; off: 0
  Vector6 bias = Vector6::Zero();              ///< reading of the unloaded sensor at ambient_c; off: 0
  Vector6 noise = Vector6::Zero();             ///< standard deviation of a reading; off: 0
  double low_pass_hz = 0;                      ///< corner of the amplifier's first-order filter; off: 0
  std::uint64_t noise_seed = 0;
};

/// Flexure, gauges and amplifier of a six-axis force/torque sensor, sample by sample:
///
///     load -> cross-talk -> drift with temperature -> bias -> noise -> low-pass -> reading.
///
/// Range, overload and resolution belong to the converter after it (`AnalogueChannel`). The temperature rises
/// exponentially from ambient to ambient + warm_up. The low-pass reduces the noise as well; the noise added
/// is larger by that factor, so that a reading's standard deviation is `noise` with or without the low-pass.
class ForceTorqueTransducer {
 public:
  /// `sample_period`: s.
  ForceTorqueTransducer(const TransducerParameters& parameters, double sample_period);

  /// Returns the reading one sample period after the last one. The filter starts at the first load.
  [[nodiscard]] Vector6 measure(const Wrench& F_So_S) noexcept;
  [[nodiscard]] double temperature_c() const noexcept { return parameters_.ambient_c + rise_; }

 private:
  TransducerParameters parameters_;
  double warming_;         // share of the remaining temperature rise made in a sample period
  double weight_ = 1;      // of a new value in the low-pass
  double noise_gain_ = 1;  // ratio of the noise added to the noise of the reading
  double rise_ = 0;        // K
  bool settled_ = false;
  Vector6 filtered_ = Vector6::Zero();
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

}  // namespace walkman::nodes
