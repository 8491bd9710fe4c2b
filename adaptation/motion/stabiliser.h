#pragma once

#include <Eigen/Core>

#include "adaptation/motion/balance.h"

namespace walkman::motion {

/// Of pairs the first is along the feet, the second across.
struct StabiliserOptions {
  /// The reference gives way to the centre of mass by this time multiplied with its velocity, s. With the
  /// sway's angular frequency w and w_p = sqrt(g / height) it adds (w² + w_p²) / (2 w) times it to the
  /// damping ratio: 0.27 along and 0.19 across for WALK-MAN's springs.
  Eigen::Vector2d velocity_time{0.06, 0.025};
  /// The reference follows the centre of pressure at this rate, 1/s, and leaks back at the other.
  Eigen::Vector2d cop_rate{0.6, 0.4};
  double cop_leak = 2.5;
  /// What stays, as by an unknown load or a sensor's residual, is taken out of the centre of pressure at this
  /// rate, 1/s. Leak and washout leave the sways' frequencies alone, and nothing of a push after 3 s.
  double cop_washout = 2;
  /// Bandwidth with which the estimated velocity follows the joints; what is faster comes from the ankles'
  /// force, rad/s. Above the sways, below what the joints' resolution of 30 µm would turn into noise.
  double observer_bandwidth = 25;
  double force_washout = 0.5;  ///< how fast the force's residual is learnt, 1/s
  /// Corner of the velocity's two first-order low-passes. From a sample to what comes of it in the joints
  /// pass three cycles; at 30 Hz, where a standing WALK-MAN's legs resonate, that is more than a third of a
  /// turn, and the law would feed it. At the sways the filter costs 24 and 43 degrees.
  double low_pass_hz = 6;
  double max_shift = 0.04;  ///< m
  double max_rate = 0.3;    ///< m/s
  double fade_in = 1;       ///< s, after `restart`
  double least_load = 50;   ///< N; with less on a foot its centre of pressure means nothing
};

/// Damps the sway of a robot that stands on two feet on elastic joints. Every cycle it finds how far the
/// reference's centre of mass is to be shifted, from the measured balance.
///
/// Two laws add up: a velocity admittance, and a leaky centre-of-pressure admittance (as in Caron, Kheddar
/// and Tempier, ICRA 2019) that also lowers the peak of the centre of pressure. The velocity is observed from
/// Newton's law at the ankles and the joints' positions; it has no part at rest, so neither law has a say in
/// where the robot stands. Allocates nothing, throws nothing.
class Stabiliser {
 public:
  explicit Stabiliser(const StabiliserOptions& options = {}) : options_(options) {}

  /// Forgets the past but not the shift, from which the next step goes on: after cycles without a reading.
  void restart() noexcept { running_ = false; }

  /// One cycle of `dt` s: the measured balance, the robot's `mass` (kg) with what it is known to carry, and
  /// where the reference has its centre of mass (m, in T). Returns the shift.
  const Eigen::Vector2d& step(const BalanceReading& reading, double mass,
                              const Eigen::Vector2d& com_reference, double dt) noexcept;

  /// Of the reference's centre of mass, m, horizontal, in T.
  [[nodiscard]] const Eigen::Vector2d& shift() const { return shift_; }
  /// Of the centre of mass, m/s, horizontal, in T.
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
  Eigen::Vector2d acceleration_ = Eigen::Vector2d::Zero();  // by the ankles' force
  Eigen::Vector2d residual_ = Eigen::Vector2d::Zero();      // of that, m/s²
  Eigen::Vector2d com_reference_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d cop_mean_ = Eigen::Vector2d::Zero();   // from the reference's centre of mass
  Eigen::Vector2d cop_shift_ = Eigen::Vector2d::Zero();  // the second law's part
  Eigen::Vector2d first_stage_ = Eigen::Vector2d::Zero(), filtered_velocity_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d shift_ = Eigen::Vector2d::Zero();
};

}  // namespace walkman::motion
