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

/// One contact the solver holds, for judging and for pictures.
struct Contact {
  std::string_view body_a, body_b;  ///< names of URDF links or scene bodies, the plant's
  Eigen::Vector3d p_WC;             ///< m
  double normal_force = 0;          ///< N
};

/// Two bodies of the robot that do not collide with each other.
struct AllowedOverlap {
  std::string link_a, link_b;  ///< the URDF links the rigid bodies hang on
  std::string reason;          ///< adjacent, compound joint, same hand, touch at zero or touch at start
};

/// What is not as it should be of an object.
struct ObjectFault {
  double friction = 1;                    ///< share that its surfaces keep
  double extra_mass = 0;                  ///< at its centre of mass, kg
  std::vector<std::string> lost_weights;  ///< that are on it no longer
};

/// Something starts inside something else; what() is one sentence.
class StartsInside : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The physical world: robot, objects and surroundings in Bullet, one step per millisecond.
///
/// A drive's electronics act on its actuator in `kSubSteps` control sub-steps per physics step; the multibody
/// moves once. Everything that reads a pose or a contact here is ground truth and stays on this side of the
/// wire.
class Plant {
 public:
  static constexpr double kStep = 1e-3;  ///< s
  static constexpr int kSubSteps = 4;
  static constexpr double kGravity = kNominalGravity;  ///< m/s², without model error

  /// Builds the world of `scene` around `robot`; `devices` tells which joints have which actuator class and
  /// where force/torque sensors and inertial units sit. `errors` is how the robot's drives differ from their
  /// classes; it starts with the scene's posture on its encoders. Throws std::runtime_error when a class or
  /// frame is missing, or a link of the rope or of a push, and StartsInside when something starts more than
  /// 2 mm inside something else.
  Plant(const RobotModel& robot, const Scene& scene, const DeviceTable& devices,
        const std::map<std::string, ActuatorParameters>& actuators, const RobotErrors& errors = {});
  ~Plant();
  Plant(const Plant&) = delete;
  Plant& operator=(const Plant&) = delete;

  /// Drives in the order of the device table: joints first met, then hands where they stand in it.
  [[nodiscard]] int drive_count() const;
  [[nodiscard]] const ActuatorReadings& readings(int drive) const;
  /// One control sub-step of a drive: motor torque wanted, N·m; holding brake.
  void advance_drive(int drive, double wanted_torque, bool locked);
  /// What is broken of a drive's actuator from now on.
  void set_actuator_fault(int drive, const ActuatorFault& fault);
  /// What is not as it should be of an object from now on, in place of the fault before.
  void set_object_fault(int object, const ObjectFault& fault);
  /// A force at the origin of a robot's link, for the next step.
  void push(int robot_link, const Eigen::Vector3d& force_W);
  /// Rate at which the camera's laser is to turn, rad/s; nothing for a camera without.
  void turn_spindle(double rate);
  /// An onlooker sees the robot begin a phase of its task: what the scene has for then is played.
  void begin_phase(std::string_view phase);
  /// Faults of sensors that the scene has had begin since the last question; the plant has no electronics.
  [[nodiscard]] std::vector<SensorFaultEvent> take_sensor_faults();
  /// Moves the world on by one step with the torques of the last `kSubSteps` sub-steps.
  void step();

  /// Loads on the force/torque sensors in the order of the device table.
  [[nodiscard]] const Wrench& F_So_S(int sensor) const;

  /// Motion of the inertial units in the order of the device table.
  [[nodiscard]] const InertialMotion& inertial_motion(int unit) const;
  /// Of the camera's own unit; null for a camera without.
  [[nodiscard]] const InertialMotion* camera_motion() const;

  // Ground truth.
  [[nodiscard]] double time() const;     ///< s
  [[nodiscard]] double gravity() const;  ///< m/s²
  [[nodiscard]] Eigen::Isometry3d X_WL(int robot_link) const;
  [[nodiscard]] Eigen::Isometry3d X_WO(int object) const;
  /// An object with the weights it carries now, as it is.
  [[nodiscard]] const SceneObject& object(int index) const;
  /// Pull of a hoisted base's rope, N; 0 when it is slack or there is none.
  [[nodiscard]] double hoist_tension() const;
  [[nodiscard]] double joint_position(int robot_joint) const;  ///< rad; fixed joints 0
  [[nodiscard]] double joint_velocity(int robot_joint) const;  ///< rad/s
  /// What the joint's actuator gave its link in the last step, N·m; 0 of a joint without a drive of its own.
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
