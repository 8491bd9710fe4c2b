#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

namespace walkman::nodes {

/// Sensor readings of a drive at one control step. Positions and velocities in rad and rad/s on the joint
/// side of the gearbox, with the resolution of its encoders.
struct ServoFeedback {
  double motor_position = 0;
  double motor_velocity = 0;
  double link_position = 0;
  double link_velocity = 0;
  double spring_torque = 0;         ///< of the series spring on the link, N·m
  double motor_temperature_c = 25;  ///< degC
  double board_temperature_c = 25;  ///< degC
  double supply_voltage = 48;       ///< DC link, V (6079h)
  /// Measured motor current, A; NaN if the drive has no current sensor of its own.
  double motor_current = std::numeric_limits<double>::quiet_NaN();
  std::uint32_t digital_inputs = 0;  ///< as 60FDh: bit 0 negative limit switch, 1 positive, 2 home
};

/// Gains of one loop: proportional, integral, derivative.
struct LoopGains {
  double p = 0, i = 0, d = 0;
};

/// Gains of the three loops (2040h-2042h). Position: N·m/rad, N·m/(rad s), N·m·s/rad. Velocity: N·m·s/rad,
/// N·m/rad, N·m·s²/rad. Torque: 1, 1/s, N·m·s/rad.
struct ServoGains {
  LoopGains position, velocity, torque;

  /// Critically damped loops of `bandwidth_hz` around the inertia J (kg·m²) of the motor reflected to the
  /// joint: with w the bandwidth, position P = J w^2 and D = 2 J w, velocity P = 2 J w and I = J w^2. Torque
  /// D = 1.4 sqrt(J K_s) with the spring's K_s in N·m/rad: damping ratio 0.7 with the link held.
  [[nodiscard]] static ServoGains factory(double inertia, double spring, double bandwidth_hz) noexcept;
};

/// The control laws of a series elastic joint drive. All torques in N·m on the joint side; the motor follows
/// J q_m'' = tau - tau_s, with the spring torque tau_s on the link. Position and velocity loops feed tau_s
/// forward, which relieves them of the load.
class ServoLaw {
 public:
  void set_gains(const ServoGains& gains) noexcept { gains_ = gains; }
  /// Clears the integrals: on enabling, and on a change of mode.
  void restart() noexcept;
  /// Notes whether the last torque was limited: integrals then grow no further in that direction
  /// (anti-windup).
  void limited(bool limited, double torque) noexcept { cut_ = limited ? torque : 0; }

  /// tau = P (q_d - q_m) + D (q_d' - q_m') + I integral + tau_s. `dt` in s, here and below.
  [[nodiscard]] double position(double demand, double demand_velocity, const ServoFeedback& f,
                                double dt) noexcept;
  /// tau = P (v_d - q_m') + I integral + D derivative + tau_s.
  [[nodiscard]] double velocity(double demand, const ServoFeedback& f, double dt) noexcept;
  /// Torque demanded in the spring: tau = tau_d + P (tau_d - tau_s) + I integral - D (q_m' - q_l'). The last
  /// term damps the motor against the spring and vanishes at rest.
  [[nodiscard]] double torque(double wanted, const ServoFeedback& f, double dt) noexcept;
  /// Impedance on the link side: demands tau_d = K (q_d - q_l) - D q_l' + offset in the spring, by means of
  /// `torque`.
  [[nodiscard]] double impedance(double demand, double stiffness, double damping, double offset,
                                 const ServoFeedback& f, double dt) noexcept;
  /// Largest torque that still leads to `speed` (rad/s), with the D gain of the position loop: for a speed
  /// limit in torque modes.
  [[nodiscard]] double torque_at(double speed, const ServoFeedback& f) const noexcept {
    return gains_.position.d * (speed - f.motor_velocity) + f.spring_torque;
  }

 private:
  [[nodiscard]] double integrated(double gain, double error, double dt) noexcept;

  ServoGains gains_;
  double integral_ = 0;  // N·m
  double cut_ = 0;       // the last torque if it was limited, else 0
  double last_error_ = 0;
  bool has_last_error_ = false;
};

inline void ServoLaw::restart() noexcept {
  integral_ = cut_ = 0;
  has_last_error_ = false;
}

inline double ServoLaw::integrated(double gain, double error, double dt) noexcept {
  if (gain == 0) return integral_ = 0;
  if (cut_ * error <= 0) integral_ += gain * error * dt;
  return integral_;
}

inline double ServoLaw::position(double demand, double demand_velocity, const ServoFeedback& f,
                                 double dt) noexcept {
  const LoopGains& g = gains_.position;
  const double error = demand - f.motor_position;
  return g.p * error + g.d * (demand_velocity - f.motor_velocity) + f.spring_torque +
         integrated(g.i, error, dt);
}

inline double ServoLaw::velocity(double demand, const ServoFeedback& f, double dt) noexcept {
  const LoopGains& g = gains_.velocity;
  const double error = demand - f.motor_velocity;
  const double rate = has_last_error_ ? (error - last_error_) / dt : 0;
  last_error_ = error;
  has_last_error_ = true;
  return g.p * error + integrated(g.i, error, dt) + g.d * rate + f.spring_torque;
}

inline double ServoLaw::torque(double wanted, const ServoFeedback& f, double dt) noexcept {
  const LoopGains& g = gains_.torque;
  const double error = wanted - f.spring_torque;
  return wanted - g.d * (f.motor_velocity - f.link_velocity) + g.p * error + integrated(g.i, error, dt);
}

inline double ServoLaw::impedance(double demand, double stiffness, double damping, double offset,
                                  const ServoFeedback& f, double dt) noexcept {
  return torque(stiffness * (demand - f.link_position) - damping * f.link_velocity + offset, f, dt);
}

inline ServoGains ServoGains::factory(double inertia, double spring, double bandwidth_hz) noexcept {
  const double w = 2 * std::numbers::pi * bandwidth_hz;
  ServoGains gains;
  gains.position = {inertia * w * w, 0, 2 * inertia * w};
  gains.velocity = {2 * inertia * w, inertia * w * w, 0};
  gains.torque = {0, 0, 1.4 * std::sqrt(inertia * spring)};
  return gains;
}

}  // namespace walkman::nodes
