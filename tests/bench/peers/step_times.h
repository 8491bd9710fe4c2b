#pragma once

#include <cstddef>
#include <vector>

namespace walkman::peers {

/// Durations of one kind of step, in wall-clock time and in processor time of the thread.
class StepTimes {
 public:
  /// Runs `step` and records how long it took.
  template <typename Step>
  void time(const Step& step) {
    const double wall = wall_us();
    const double processor = processor_us();
    step();
    processor_.push_back(processor_us() - processor);
    wall_.push_back(wall_us() - wall);
  }

  /// Returns the time that the fraction `part` of the steps does not exceed, us. NaN without steps.
  [[nodiscard]] double wall(double part) const { return quantile(wall_, part); }
  [[nodiscard]] double processor(double part) const { return quantile(processor_, part); }

 private:
  static double wall_us();
  static double processor_us();
  static double quantile(std::vector<double> values, double part);

  std::vector<double> wall_, processor_;
};

}  // namespace walkman::peers
