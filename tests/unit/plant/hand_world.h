#pragma once

#include <memory>
#include <set>
#include <string>

#include "emulator/plant/contact/contact_dispatcher.h"
#include "emulator/plant/dynamics/plant_world.h"
#include "emulator/plant/dynamics/row_space_solver.h"
#include "emulator/plant/hands/slip_meter.h"
#include "emulator/plant/hands/soft_hand.h"

namespace walkman::tests {

inline constexpr double kPulley = 0.04;  // m

/// The object that a test's hand holds, and how.
struct Grasp {
  char side = 'R';         ///< R or L
  double diameter = 0.07;  ///< of the cylinder, m
  double length = 0.4;     ///< m
  double mass = 0.5;       ///< kg
  double friction = 0.8;   ///< of the pair of surfaces
};

/// One hand of the robot alone, its palm fixed in space and facing down, and a cylinder across it: axis along
/// the palm's x, touching the palm's face. No gravity until it is switched on.
class HandWorld {
 public:
  static constexpr double kStep = 1e-3;  // s
  static constexpr double kGravity = 9.81;

  explicit HandWorld(const Grasp& grasp);

  /// Lets the motor pull with `torque` (N·m) for `seconds`.
  void run(double seconds, double torque);
  /// Runs one step, with a force (N, at the centre of mass) and a torque (N·m) on the cylinder, world axes.
  void step(double torque, const Eigen::Vector3d& f_W = Eigen::Vector3d::Zero(),
            const Eigen::Vector3d& t_W = Eigen::Vector3d::Zero());
  void switch_gravity_on() { world_.setGravity(btVector3(0, 0, -kGravity)); }

  /// Sum of the normal forces on the cylinder, N.
  [[nodiscard]] double grip();
  /// Force through the cylinder's middle plane, which is parallel to the palm's face, N: what a force sensor
  /// between its halves measures along the palm's normal.
  [[nodiscard]] double squeeze();
  /// Stiffness of the cylinder's seat for small displacements of its centre of mass and rotations about it,
  /// (m, rad) to (N, N·m), world axes: the pads' springs at the present contacts, each along its normal and,
  /// by Mindlin's ratio, along its face, in series with the joints of the fingers that they are on. A joint's
  /// springs are its ligament, the tendon between joints if it sticks to its pulleys, and its run to the
  /// motor.
  [[nodiscard]] Eigen::Matrix<double, 6, 6> stiffness(bool tendon_sticks);
  /// Links that press on the cylinder.
  [[nodiscard]] std::set<std::string> touching();
  /// Pose of the cylinder in the frame of the palm's face: x along its axis when it is not turned, y out of
  /// the palm (right hand; into it, left), z towards the wrist.
  [[nodiscard]] Eigen::Isometry3d X_PO() const;
  [[nodiscard]] double motor_position() const { return hand_->readings().motor_position; }
  [[nodiscard]] double tension() const { return hand_->tension(); }
  [[nodiscard]] const plant::Slip& slip() const { return meter_->slip(); }

 private:
  template <typename Visit>
  void for_each_contact(Visit visit);

  RobotModel hand_model_, cylinder_model_;
  btDefaultCollisionConfiguration configuration_;
  plant::ContactDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  plant::RowSpaceSolver solver_;
  plant::PlantWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  std::unique_ptr<plant::Multibody> body_, cylinder_;
  plant::ActuatorParameters actuator_;
  std::unique_ptr<plant::SoftHand> hand_;
  std::unique_ptr<plant::SlipMeter> meter_;
  int palm_face_ = 0;  // link at the centre of the palm's face
};

}  // namespace walkman::tests
