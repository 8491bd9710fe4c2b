#include "adaptation/motion/rest_watch.h"

#include <algorithm>
#include <cmath>

namespace walkman::motion {
namespace {

// Time between the two positions that give the speed: a quarter of the period of an arm on its springs,
// 10 Hz. The encoders' resolution, some 20 µm at the hand, then corresponds to 1 mm/s.
constexpr double kBase = 0.025;  // s

}  // namespace

bool RestWatch::at_rest(const Eigen::Vector3d& p_W, double dt) noexcept {
  const int apart = std::clamp(static_cast<int>(std::lround(kBase / dt)), 1, kRoom - 1);
  positions_[static_cast<std::size_t>(count_ % kRoom)] = p_W;
  const int before = count_++ - apart;
  if (before < 0) return false;
  const double speed = (p_W - positions_[static_cast<std::size_t>(before % kRoom)]).norm() / (apart * dt);
  if (speed > fastest_) unrest_ = speed;
  still_for_ = speed <= fastest_ ? still_for_ + dt : 0;
  return still_for_ >= span_;
}

}  // namespace walkman::motion
