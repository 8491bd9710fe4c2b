#pragma once

#include <cmath>

namespace walkman::nodes {

/// Tells that a value has stayed within a window for a time: 6067h/6068h, 606Dh/606Eh, 606Fh/6070h.
class Window {
 public:
  void restart() noexcept { inside_for_ = 0, reached_ = false; }
  void step(double deviation, double window, double time, double dt) noexcept {
    if (!(std::abs(deviation) <= window)) return restart();
    inside_for_ += dt;
    reached_ = reached_ || inside_for_ >= time;
  }
  [[nodiscard]] bool reached() const noexcept { return reached_; }

 private:
  double inside_for_ = 0;
  bool reached_ = false;
};

}  // namespace walkman::nodes
