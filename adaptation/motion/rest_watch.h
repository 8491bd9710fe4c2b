#pragma once

#include <array>

#include <Eigen/Core>

namespace walkman::motion {

/// Tells from its measured positions when a point that swings has come to rest: when it was no faster than a
/// given speed for a given time. Whatever swings reaches its greatest speed twice a period, so that time is
/// half the period of the slowest oscillation that matters. Allocates nothing, throws nothing.
class RestWatch {
 public:
  /// `speed` in m/s, `span` in s.
  RestWatch(double speed, double span) noexcept : fastest_(speed), span_(span) {}

  /// The next position p_W (m), `dt` s after the last. True when the point is at rest.
  [[nodiscard]] bool at_rest(const Eigen::Vector3d& p_W, double dt) noexcept;
  /// The last speed that was no rest, m/s.
  [[nodiscard]] double unrest() const { return unrest_; }

 private:
  static constexpr int kRoom = 64;

  double fastest_, span_;
  std::array<Eigen::Vector3d, kRoom> positions_{};
  int count_ = 0;
  double unrest_ = 0;
  double still_for_ = 0;  // s
};

}  // namespace walkman::motion
