#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <random>
#include <vector>

#include "emulator/nodes/measuring/force_torque_transducer.h"

namespace walkman::nodes {

/// Alters readings as a broken force/torque sensor does: wrong or swapped axes, drift, noise, a saturated
/// amplifier, frozen readings, a bit of the converter that sticks or flips.
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
    Vector6 drift = Vector6::Zero();       ///< N/s and N·m/s, from the beginning of the fault
    Vector6 noise = Vector6::Zero();       ///< standard deviation, N and N·m
    Vector6 end = Vector6::Constant(std::numeric_limits<double>::infinity());  ///< max. magnitude, N and N·m
    bool forces_stuck = false, torques_stuck = false;                          ///< at the first reading
    std::optional<Bit> bit;
    std::uint64_t seed = 1;  ///< for the noise and the choice of the samples whose bit is flipped
  };

  /// `units`: units of the integers on the wire, N and N·m; `sample_period`: s.
  ReadingFault(const Parameters& parameters, const Vector6& units, double sample_period);

  /// Begins, possibly not for the first time: the drift starts from zero, and a reading that is stuck is
  /// taken anew. The random draws continue.
  void start() noexcept;

  // The stages of a sensor, in their order: each alters one sample.
  void rewire(Vector6& reading) const noexcept;
  void drift(Vector6& reading) noexcept;
  void disturb(Vector6& reading) noexcept;
  void saturate(Vector6& reading) const noexcept;
  void freeze(Vector6& reading) noexcept;
  void convert(Vector6& reading) noexcept;

 private:
  Parameters parameters_;
  Vector6 units_;
  double sample_period_;
  double time_ = 0;              // s
  std::optional<Vector6> held_;  // the first reading
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

/// The active faults of one sensor. They act together stage by stage, and at each stage in the order in which
/// they began: noise reaches an amplifier that saturates, but never a reading that is frozen, whichever of
/// the two faults was there first. Each keeps its own time, frozen reading and random stream.
class ReadingFaults {
 public:
  /// `fault` must stay valid until it is removed.
  void add(ReadingFault& fault) { active_.push_back(&fault); }
  void remove(const ReadingFault& fault) noexcept { std::erase(active_, &fault); }

  /// Applies all of them to one sample.
  [[nodiscard]] Vector6 apply(const Vector6& reading) noexcept;

 private:
  std::vector<ReadingFault*> active_;
};

}  // namespace walkman::nodes
