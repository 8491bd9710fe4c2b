#pragma once

namespace walkman::nodes {

/// What a drive's sensors say at one control step. Positions and velocities in rad and rad/s on the joint
/// side of the gearbox, as its encoders resolve them.
struct ServoFeedback {
  double motor_position = 0;
  double motor_velocity = 0;
  double link_position = 0;
  double link_velocity = 0;
  double spring_torque = 0;  ///< of the series spring on the link, N m
  double motor_temperature_c = 25;
  double board_temperature_c = 25;
  double supply_voltage = 48;
};

/// The control laws of a series elastic joint drive. All torques in N m on the joint side; the motor follows
/// J q_m'' = tau - tau_s, with the spring torque tau_s on the link.
class ServoLaw {
 public:
  /// `inertia` J: motor, reflected to the joint, kg m^2; `spring` K_s: N m/rad; `bandwidth_hz` of the
  /// position loop.
  ServoLaw(double inertia, double spring, double bandwidth_hz);

  /// Cyclic synchronous position: tau = J w^2 (q_d - q_m) + 2 J w (q_d' - q_m') + tau_s. The fed-forward
  /// spring torque takes the load off the loop, which leaves a critically damped second-order motor: no
  /// static error under a constant load.
  [[nodiscard]] double position(double demand, double demand_velocity, const ServoFeedback& f) const noexcept;

  /// A torque wanted in the spring: tau = tau_d - D_s (q_m' - q_l'), with D_s = 1.4 sqrt(J K_s). The second
  /// term damps the motor against the spring (damping ratio 0.7 with the link held) and vanishes at rest.
  [[nodiscard]] double torque(double wanted, const ServoFeedback& f) const noexcept;

  /// Impedance on the link side: the spring is to pull with tau_d = K (q_d - q_l) - D q_l' + offset, by
  /// `torque`.
  [[nodiscard]] double impedance(double demand, double stiffness, double damping, double offset,
                                 const ServoFeedback& f) const noexcept;

 private:
  double kp_, kd_, spring_damping_;
};

}  // namespace walkman::nodes
