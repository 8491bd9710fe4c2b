#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <random>

#include "emulator/nodes/measuring/force_torque_transducer.h"

namespace walkman::nodes {

/// What a broken force/torque sensor makes of its readings: wrong or swapped axes, drift, a bit of the
/// converter that sticks or flips, noise, an amplifier at its end, readings that stand still.
class ReadingFault {
 public:
  struct Bit {
    std::size_t channel = 0;
    int number = 0;             ///< of the two's complement of 16 bits on the wire, 0 the lowest
    std::optional<bool> stuck;  ///< at that; else it is flipped
    double share = 1;           ///< of the samples in which it is
  };
  struct Parameters {
    Matrix6 matrix = Matrix6::Identity();  ///< reading over what it should be
    Vector6 drift = Vector6::Zero();       ///< N/s and N·m/s, from now on
    Vector6 noise = Vector6::Zero();       ///< standard deviation, N and N·m
    Vector6 end = Vector6::Constant(std::numeric_limits<double>::infinity());  ///< most and least, N and N·m
    bool forces_stuck = false, torques_stuck = false;  ///< at the first reading from now on
    std::optional<Bit> bit;
    std::uint64_t seed = 1;  ///< of the noise, and of the samples whose bit is flipped
  };

  /// `units`: of the integers on the wire, N and N·m; `sample_period`: s.
  ReadingFault(const Parameters& parameters, const Vector6& units, double sample_period);

  /// One sample.
  [[nodiscard]] Vector6 apply(const Vector6& reading) noexcept;

 private:
  [[nodiscard]] Vector6 disturbed(const Vector6& reading) noexcept;
  Parameters parameters_;
  Vector6 units_;
  double sample_period_;
  double time_ = 0;              // s
  std::optional<Vector6> held_;  // the first
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

}  // namespace walkman::nodes
