#pragma once

#include <Eigen/Core>

#include "adaptation/motion/balance.h"

namespace walkman::motion {

/// In pairs, the first value is along the feet, the second across.
struct StabiliserOptions {
  /// The reference is shifted against the velocity of the centre of mass, by this time (s) multiplied by it.
  /// With the sway's angular frequency w and w_p = sqrt(g / height), this adds (w² + w_p²) / (2 w) times the
  /// value to the damping ratio: 0.27 along and 0.19 across for WALK-MAN's springs.
  Eigen::Vector2d velocity_time{0.06, 0.025};
  /// The reference follows the centre of pressure at the rate cop_rate, 1/s, and leaks back at cop_leak.
  Eigen::Vector2d cop_rate{0.6, 0.4};
  double cop_leak = 2.5;
  /// A constant part, for instance from an unknown load or a sensor's residual, is removed from the centre of
  /// pressure at this rate, 1/s. Leak and washout do not change the sway frequencies, and leave nothing of a
  /// push after 3 s.
  double cop_washout = 2;
  /// Bandwidth with which the estimated velocity follows the joints, rad/s; faster components come from the
  /// ankles' force. Above the sways, below where the joints' resolution of 30 µm would become noise.
  double observer_bandwidth = 25;
  double force_washout = 0.5;  ///< rate at which the force's residual is estimated, 1/s
  /// Corner of the velocity's two first-order low-passes. A sample takes three cycles to have an effect in
  /// the joints; at 30 Hz, where a standing WALK-MAN's legs resonate, that is more than a third of a period,
  /// and the law would excite the resonance. At the sway frequencies the filter costs 24 and 43 degrees of
  /// phase.
  double low_pass_hz = 6;
  double max_shift = 0.04;  ///< m
  double max_rate = 0.3;    ///< m/s
  double fade_in = 1;       ///< s, after `restart`
  double least_load = 50;   ///< N; with less on a foot, its centre of pressure is meaningless
};

/// Damps the sway of a robot that stands on two feet and has elastic joints. Each cycle it computes from the
/// measured balance how far the reference's centre of mass is to be shifted.
///
/// Two laws add up: a velocity admittance, and a leaky centre-of-pressure admittance (as in Caron, Kheddar
/// and Tempier, ICRA 2019) that also lowers the peak of the centre of pressure. The velocity is estimated
/// from Newton's law at the ankles and the joint positions; it vanishes at rest, so neither law affects where
/// the robot stands. Neither allocates nor throws.
class Stabiliser {
 public:
  explicit Stabiliser(const StabiliserOptions& options = {}) : options_(options) {}

  /// Call after cycles without a reading: clears the state but keeps the shift, from which the next step
  /// continues.
  void restart() noexcept { running_ = false; }

  /// Runs one cycle of `dt` s, given the measured balance, the `mass` (kg) of the robot and its known
  /// payload, and the centre of mass of the reference (m, in T). Returns the shift.
  const Eigen::Vector2d& step(const BalanceReading& reading, double mass,
                              const Eigen::Vector2d& com_reference, double dt) noexcept;

  /// Shift of the reference's centre of mass, m, horizontal, in T.
  [[nodiscard]] const Eigen::Vector2d& shift() const { return shift_; }
  /// Velocity of the centre of mass, m/s, horizontal, in T.
  [[nodiscard]] const Eigen::Vector2d& velocity() const { return velocity_; }

 private:
  void start(const BalanceReading& reading, double mass, const Eigen::Vector2d& com_reference) noexcept;
  void observe(const BalanceReading& reading, double mass, double dt) noexcept;
  void follow_cop(const BalanceReading& reading, const Eigen::Vector2d& com_reference, double dt) noexcept;

  StabiliserOptions options_;
  bool running_ = false;
  double running_for_ = 0;  // s
  Eigen::Vector2d position_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d velocity_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d acceleration_ = Eigen::Vector2d::Zero();  // from the ankles' force
  Eigen::Vector2d residual_ = Eigen::Vector2d::Zero();      // of the acceleration, m/s²
  Eigen::Vector2d com_reference_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d cop_mean_ = Eigen::Vector2d::Zero();   // relative to the reference's centre of mass
  Eigen::Vector2d cop_shift_ = Eigen::Vector2d::Zero();  // the second law's part
  Eigen::Vector2d first_stage_ = Eigen::Vector2d::Zero(), filtered_velocity_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d shift_ = Eigen::Vector2d::Zero();
};

}  // namespace walkman::motion
