#pragma once

#include <string>
#include <vector>

#include "emulator/plant/actuators/series_elastic_actuator.h"
#include "emulator/plant/dynamics/multibody.h"

namespace walkman::plant {

/// Tendon and passive parameters of the underactuated hand. The lever arms are those of the emulated fingers;
/// tendon losses and ligaments are estimates from the published SoftHands (Catalano et al., IJRR 33(5),
/// 2014), chosen within their ranges so that a cylinder of 45 mm is held with 130 N, which the WALK-MAN
/// design document gives as the hand's peak, when the motor gives its 5 N·m.
struct SoftHandParameters {
  double pulley_radius = 0.04;      ///< m, at the synergy motor
  double proximal_radius = 0.0112;  ///< m, tendon lever arm at a finger's first joint
  double distal_radius = 0.008;     ///< m, at its second joint
  double thumb_factor = 2.5;        ///< ratio of thumb to finger lever arms: the thumb opposes four fingers
  double efficiency = 0.7;          ///< of the tendon over its pulleys, estimated at 0.5 to 0.7
  double tendon_stiffness = 5e4;    ///< N/m, of the tendon between two joints: Dyneema, estimated
  double return_stiffness = 0.1;    ///< N·m/rad, elastic ligament towards the open posture; 0.1 to 0.5
  double return_pretension = 0.1;   ///< N·m, of the ligament in the open posture; 0.1 to 0.2
  double joint_damping = 0.01;      ///< N·m·s/rad
  double stop_stiffness = 5;        ///< N·m/rad, beyond a joint's limits
};

/// One motor pulling one tendon that runs over every finger joint (adaptive synergy): all joints share the
/// tendon's tension, so each finger closes until it meets something. Pulley friction lowers the tension at a
/// finger that closes and raises it at one that is forced open; between these two levels the tendon sticks,
/// and a finger is as stiff as the tendon.
class SoftHand {
 public:
  /// The hand's joints are the URDF joints that mimic `synergy_joint`; their mimic offsets are the open
  /// posture.
  SoftHand(const RobotModel& model, Multibody& body, const std::string& synergy_joint,
           const ActuatorParameters& actuator, const SoftHandParameters& parameters);

  /// Resets to the open posture, at rest and without tension.
  void reset();
  /// Runs one control sub-step; finger joints are at the multibody's positions, extrapolated by their
  /// velocities over `since_step` seconds. `wanted_torque`: of the synergy motor, N·m.
  void advance(double wanted_torque, bool locked, double since_step, double dt);
  /// Adds tendon, ligament and damping torques for the coming step to the multibody.
  void apply();

  void set_fault(const ActuatorFault& fault) { actuator_.set_fault(fault); }
  [[nodiscard]] const ActuatorReadings& readings() const { return actuator_.readings(); }
  [[nodiscard]] double tension() const { return tension_; }  ///< N, of the last step

 private:
  struct FingerJoint {
    int bullet_link;
    double radius;        ///< m
    double open;          ///< rad
    double lower, upper;  ///< stops, rad
    double q = 0;         ///< rad, of the last step
    double friction = 0;  ///< N·m, of the tendon against closing
  };
  Multibody& body_;
  SoftHandParameters parameters_;
  SeriesElasticActuator actuator_;
  std::vector<FingerJoint> joints_;
  double tension_sum_ = 0, tension_ = 0;
  double tension_before_ = 0;  // N, of the previous step
  int sub_steps_ = 0;
};

}  // namespace walkman::plant
