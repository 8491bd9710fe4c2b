#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "emulator/plant/actuators/series_elastic_actuator.h"
#include "emulator/plant/hands/slip_meter.h"
#include "emulator/plant/probes/inertial_probe.h"
#include "emulator/scene/scene.h"
#include "emulator/scene/true_robot.h"
#include "urdf/reader/device_table.h"
#include "urdf/reader/wrench.h"

namespace walkman::plant {

/// One contact in the solver, for evaluation and for pictures.
struct Contact {
  std::string_view body_a, body_b;  ///< names of URDF links or scene bodies, owned by the plant
  Eigen::Vector3d p_WC;             ///< m
  double normal_force = 0;          ///< N
};

/// Two bodies of the robot that do not collide with each other.
struct AllowedOverlap {
  std::string link_a, link_b;  ///< URDF links at the roots of the two rigid bodies
  std::string reason;          ///< adjacent, compound joint, same hand, touch at zero or touch at start
};

/// Faults of an object.
struct ObjectFault {
  double friction = 1;                    ///< remaining share of its surfaces' friction
  double extra_mass = 0;                  ///< added at its centre of mass, kg
  std::vector<std::string> lost_weights;  ///< weights that it no longer carries
};

/// Thrown when something starts inside something else; what() is one sentence.
class StartsInside : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The physical world: robot, objects and surroundings in Bullet, one step per millisecond.
///
/// A drive's electronics act on its actuator in `kSubSteps` control sub-steps per physics step; the multibody
/// moves once. Every pose or contact that can be read here is ground truth and stays on this side of the
/// wire.
class Plant {
 public:
  static constexpr double kStep = 1e-3;  ///< s
  static constexpr int kSubSteps = 4;
  static constexpr double kGravity = kNominalGravity;  ///< m/s², without model error

  /// Builds the world of `scene` around `robot`; `devices` gives the actuator class of each joint and the
  /// places of force/torque sensors and inertial units. `errors`: how the robot's drives differ from their
  /// classes; the robot starts with its encoders reading the scene's posture. Throws std::runtime_error if a
  /// class, a frame, or a link of the rope or of a push is missing, and StartsInside if something starts more
  /// than 2 mm inside something else.
  Plant(const RobotModel& robot, const Scene& scene, const DeviceTable& devices,
        const std::map<std::string, ActuatorParameters>& actuators, const RobotErrors& errors = {});
  ~Plant();
  Plant(const Plant&) = delete;
  Plant& operator=(const Plant&) = delete;

  /// Number of drives. Drives are indexed in the order of the device table, joints and hands alike.
  [[nodiscard]] int drive_count() const;
  [[nodiscard]] const ActuatorReadings& readings(int drive) const;
  /// Runs one control sub-step of a drive: commanded motor torque, N·m; whether the holding brake is closed.
  void advance_drive(int drive, double wanted_torque, bool locked);
  /// Sets the faults of a drive's actuator from now on.
  void set_actuator_fault(int drive, const ActuatorFault& fault);
  /// Sets the faults of an object from now on, replacing the previous ones.
  void set_object_fault(int object, const ObjectFault& fault);
  /// Applies a force at the origin of a robot link for the next step.
  void push(int robot_link, const Eigen::Vector3d& force_W);
  /// Sets the rate at which the camera's laser turns, rad/s; does nothing for a camera without a laser.
  void turn_spindle(double rate);
  /// Call when an onlooker sees the robot begin a phase of its task: plays the scene's events for that phase.
  void begin_phase(std::string_view phase);
  /// Returns the scene's sensor faults that have begun since the last call; the plant has no electronics.
  [[nodiscard]] std::vector<SensorFaultEvent> take_sensor_faults();
  /// Advances the world by one step with the torques of the last `kSubSteps` sub-steps.
  void step();

  /// Loads on the force/torque sensors in the order of the device table.
  [[nodiscard]] const Wrench& F_So_S(int sensor) const;

  /// Motion of the inertial units in the order of the device table.
  [[nodiscard]] const InertialMotion& inertial_motion(int unit) const;
  /// Motion of the camera's own inertial unit; null for a camera without one.
  [[nodiscard]] const InertialMotion* camera_motion() const;

  // Ground truth.
  [[nodiscard]] double time() const;     ///< s
  [[nodiscard]] double gravity() const;  ///< m/s²
  [[nodiscard]] Eigen::Isometry3d X_WL(int robot_link) const;
  [[nodiscard]] Eigen::Isometry3d X_WO(int object) const;
  /// An object in its present state, with its faults and the weights it carries now.
  [[nodiscard]] const SceneObject& object(int index) const;
  /// Tension in a hoisted base's rope, N; 0 if the rope is slack or there is none.
  [[nodiscard]] double hoist_tension() const;
  [[nodiscard]] double joint_position(int robot_joint) const;  ///< rad; 0 for fixed joints
  [[nodiscard]] double joint_velocity(int robot_joint) const;  ///< rad/s
  /// Torque of the joint's actuator on its link in the last step, N·m; 0 for a joint without a drive of its
  /// own.
  [[nodiscard]] double joint_torque(int robot_joint) const;
  [[nodiscard]] std::vector<Contact> contacts() const;
  /// Pairs of the robot's bodies that pass through each other; all others collide.
  [[nodiscard]] std::vector<AllowedOverlap> allowed_overlaps() const;
  [[nodiscard]] bool object_touches_fixed(int object) const;
  [[nodiscard]] double tendon_tension(int hand) const;  ///< N
  /// How far an object has slipped in a hand since the world was built.
  [[nodiscard]] const Slip& slip(int hand, int object) const;
  /// FNV-1a hash of all positions and velocities, for reproducibility checks.
  [[nodiscard]] std::uint64_t state_hash() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace walkman::plant
