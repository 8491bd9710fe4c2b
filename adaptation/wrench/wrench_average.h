#pragma once

#include "urdf/reader/wrench.h"

namespace walkman::wrench {

/// Running mean and spread of a wrench (Welford's recurrence, a component at a time).
class WrenchAverage {
 public:
  void add(const Wrench& sample);
  void clear() { *this = WrenchAverage(); }

  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] const Wrench& mean() const { return mean_; }
  /// Standard deviation of each component; zero below two samples.
  [[nodiscard]] Wrench deviation() const;

 private:
  int count_ = 0;
  Wrench mean_;
  Wrench squares_;  // sums of squared deviations
};

}  // namespace walkman::wrench
