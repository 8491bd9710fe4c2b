#include "emulator/plant/probes/inertial_probe.h"

#include "emulator/plant/contact/bullet_types.h"

namespace walkman::plant {

InertialProbe::InertialProbe(const Multibody& body, int sensor_link)
    : body_(&body),
      sensor_link_(sensor_link),
      group_(static_cast<std::size_t>(body.tree().group_of(sensor_link))),
      groups_(body, {body.tree().group_of(sensor_link)}) {
  const Eigen::Isometry3d X_WS = body.X_WL(sensor_link);
  motion_.q_WS = Eigen::Quaterniond(X_WS.linear());
}

void InertialProbe::measure(const std::vector<double>& before, double dt, const btVector3& gravity) {
  groups_.update(before, dt);
  const Eigen::Isometry3d X_WS = body_->X_WL(sensor_link_);
  const Eigen::Vector3d from_com = X_WS.translation() - body_->X_WM(static_cast<int>(group_)).translation();
  const btVector3 r = to_bullet(from_com);
  const btVector3& w = groups_.angular_velocity(group_);
  const btVector3 acceleration =
      groups_.acceleration(group_) + groups_.angular_acceleration(group_).cross(r) + w.cross(w.cross(r));
  const Eigen::Matrix3d R_SW = X_WS.linear().transpose();
  motion_.specific_force_S = R_SW * from_bullet(acceleration - gravity);
  motion_.angular_velocity_S = R_SW * from_bullet(w);
  motion_.q_WS = Eigen::Quaterniond(X_WS.linear());
}

}  // namespace walkman::plant
