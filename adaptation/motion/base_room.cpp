#include "adaptation/motion/base_room.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "adaptation/motion/whole_body_ik.h"

namespace walkman::motion {
namespace {

constexpr double kArm = 1.0;  // m, from the base's origin to the points that represent its angles

constexpr std::array kNames = {"forward",
                               "back",
                               "to the left",
                               "to the right",
                               "up",
                               "down",
                               "leaning forward",
                               "leaning back",
                               "leaning to the left",
                               "leaning to the right",
                               "turned to the right",
                               "turned to the left"};

}  // namespace

BaseRoom::BaseRoom(const BaseRoomOptions& options) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(),
                        z = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  const double lean = kArm * std::sin(options.lean), turn = kArm * std::sin(options.turn);
  bounds_ = {{{origin, x, options.horizontal},
              {origin, -x, options.horizontal},
              {origin, y, options.horizontal},
              {origin, -y, options.horizontal},
              {origin, z, options.up},
              {origin, -z, options.down},
              {kArm * z, x, lean, true},
              {kArm * z, -x, lean, true},
              {kArm * z, y, lean, true},
              {kArm * z, -y, lean, true},
              {kArm * y, x, turn, true},
              {kArm * y, -x, turn, true}}};
}

void BaseRoom::keep(WholeBodyIk& ik, int base_link, const Eigen::Isometry3d& X_WB,
                    double gain) const noexcept {
  for (std::size_t i = 0; i < kBounds; ++i) {
    const Bound& bound = bounds_[i];
    Eigen::Vector3d gone = X_WB * bound.p_BP - X_WB0_ * bound.p_BP;
    if (bound.relative) gone -= X_WB.translation() - X_WB0_.translation();
    const double left = bound.room - bound.n_W.dot(gone);
    const double approach = std::max(0.0, gain * left);
    if (bound.relative) {
      ik.keep_apart(base_link, bound.p_BP, base_link, Eigen::Vector3d::Zero(), -bound.n_W, approach);
    } else {
      ik.keep_clear(base_link, bound.p_BP, -bound.n_W, approach);
    }
  }
}

std::string BaseRoom::describe(int bound) const {
  const Bound& found = bounds_[static_cast<std::size_t>(bound)];
  const char* name = kNames[static_cast<std::size_t>(bound)];
  return found.relative ? fmt::format("the base is {} to its limit of {:.1f} degrees", name,
                                      std::asin(found.room / kArm) * 180 / std::numbers::pi)
                        : fmt::format("the base is at its limit of {:.0f} mm {}", 1e3 * found.room, name);
}

}  // namespace walkman::motion
