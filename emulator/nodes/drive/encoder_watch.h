#pragma once

#include <cmath>
#include <limits>

namespace walkman::nodes {

/// Keeps what one encoder's readings look like, so that the guilty one is known when two of them contradict
/// each other.
class EncoderWatch {
 public:
  /// `most`: the farthest the reading can have moved in this step, rad.
  void step(double reading, double most, double dt) noexcept {
    const double moved = std::abs(reading - last_);  // NaN at the first
    still_for_ = moved == 0 ? still_for_ + dt : 0;
    jumped_ = jumped_ || moved > most;
    last_ = reading;
  }
  /// The readings agree again.
  void trust() noexcept { jumped_ = false; }
  [[nodiscard]] bool frozen(double time) const noexcept { return still_for_ >= time; }
  [[nodiscard]] bool jumped() const noexcept { return jumped_; }

 private:
  double last_ = std::numeric_limits<double>::quiet_NaN();
  double still_for_ = 0;
  bool jumped_ = false;
};

}  // namespace walkman::nodes
