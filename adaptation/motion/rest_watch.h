#pragma once

#include <array>

#include <Eigen/Core>

namespace walkman::motion {

/// Detects from the measured positions of a swinging point when it has come to rest: when it was no faster
/// than a given speed for a given time. Anything that swings reaches its maximum speed twice per period, so
/// that time is half the period of the slowest relevant oscillation. Neither allocates nor throws.
class RestWatch {
 public:
  /// `speed` in m/s, `span` in s.
  RestWatch(double speed, double span) noexcept : fastest_(speed), span_(span) {}

  /// Processes the next position p_W (m), `dt` s after the last. Returns true if the point is at rest.
  [[nodiscard]] bool at_rest(const Eigen::Vector3d& p_W, double dt) noexcept;
  /// Last speed that exceeded the speed of rest, m/s.
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
