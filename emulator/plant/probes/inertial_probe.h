#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "emulator/plant/dynamics/group_motion.h"
#include "emulator/plant/dynamics/plant_world.h"

namespace walkman::plant {

/// Motion sensed by an inertial unit with frame S.
struct InertialMotion {
  Eigen::Vector3d specific_force_S = Eigen::Vector3d::Zero();    ///< of So: acceleration minus gravity, m/s²
  Eigen::Vector3d angular_velocity_S = Eigen::Vector3d::Zero();  ///< of S in the world, rad/s
  Eigen::Quaterniond q_WS = Eigen::Quaterniond::Identity();      ///< S in the world
};

/// An inertial unit in the plant: measures the motion of a URDF link's frame over each step, at the step's
/// start.
class InertialProbe final : public StepProbe {
 public:
  /// S is the frame of the URDF link `sensor_link`.
  InertialProbe(const Multibody& body, int sensor_link);

  /// Motion in the last step measured.
  [[nodiscard]] const InertialMotion& motion() const { return motion_; }

  [[nodiscard]] const btMultiBody& body() const override { return body_->bullet(); }
  void measure(const std::vector<double>& before, double dt, const btVector3& gravity) override;

 private:
  const Multibody* body_;
  int sensor_link_;
  std::size_t group_;
  GroupMotion groups_;
  InertialMotion motion_;
};

}  // namespace walkman::plant
