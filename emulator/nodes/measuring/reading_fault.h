#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <random>

#include "emulator/nodes/measuring/force_torque_transducer.h"

namespace walkman::nodes {

/// Alters readings as a broken force/torque sensor does: wrong or swapped axes, drift, a bit of the converter
/// that sticks or flips, noise, a saturated amplifier, frozen readings.
class ReadingFault {
 public:
  struct Bit {
    std::size_t channel = 0;
    int number = 0;             ///< in the 16-bit two's complement on the wire, 0 is the lowest
    std::optional<bool> stuck;  ///< value at which it is stuck; if empty, it is flipped
    double share = 1;           ///< share of the samples affected
  };
  struct Parameters {
    Matrix6 matrix = Matrix6::Identity();  ///< maps the correct reading to the faulty one
    Vector6 drift = Vector6::Zero();       ///< N/s and N·m/s, from now on
    Vector6 noise = Vector6::Zero();       ///< standard deviation, N and N·m
    Vector6 end = Vector6::Constant(std::numeric_limits<double>::infinity());  ///< max. magnitude, N and N·m
    bool forces_stuck = false, torques_stuck = false;  ///< at the first reading from now on
    std::optional<Bit> bit;
    std::uint64_t seed = 1;  ///< for the noise and the choice of the samples whose bit is flipped
  };

  /// `units`: units of the integers on the wire, N and N·m; `sample_period`: s.
  ReadingFault(const Parameters& parameters, const Vector6& units, double sample_period);

  /// Applies the fault to one sample.
  [[nodiscard]] Vector6 apply(const Vector6& reading) noexcept;

 private:
  [[nodiscard]] Vector6 disturbed(const Vector6& reading) noexcept;
  Parameters parameters_;
  Vector6 units_;
  double sample_period_;
  double time_ = 0;              // s
  std::optional<Vector6> held_;  // the first reading
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

}  // namespace walkman::nodes
