#include "adaptation/motion/gaze.h"

#include <algorithm>
#include <cmath>

namespace walkman::motion {

Gaze::Gaze(const KnownRobot& known, const std::vector<std::string>& joint_names)
    : posed_(known.model, joint_names),
      pan_(posed_.dof_of(known.description.gaze->pan)),
      tilt_(posed_.dof_of(known.description.gaze->tilt)),
      camera_(known.model.link_index(known.description.optical_frame)),
      guard_(posed_, {pan_, tilt_}, false, 0, known.description.working_hands().front().frame, "",
             load_disabled_collisions(known.description.srdf, known.model), {}) {}

bool Gaze::has_room(const Eigen::VectorXd& q) {
  Eigen::VectorXd q_out = q;
  for (const double pan : {-kSway, kSway}) {
    for (const double tilt : {-kSway, kSway}) {
      q_out[pan_] = q[pan_] + pan;
      q_out[tilt_] = q[tilt_] + tilt;
      posed_.update(q_out);
      guard_.update();
      if (guard_.own_clearance() <= 0) return false;
    }
  }
  return true;
}

bool Gaze::within_limits(const Eigen::VectorXd& q, int dof) const {
  return q[dof] > posed_.limits(dof).lower && q[dof] < posed_.limits(dof).upper;
}

double Gaze::sense(const Eigen::VectorXd& q, int dof, const Eigen::Vector3d& axis_C) {
  Eigen::MatrixXd J(6, posed_.dof());
  posed_.update(q);
  posed_.jacobian(camera_, Eigen::Vector3d::Zero(), J);
  return std::copysign(1, J.col(dof).head<3>().dot(posed_.X_WL(camera_).linear() * axis_C));
}

Eigen::VectorXd Gaze::towards(const Eigen::VectorXd& q, const Eigen::Vector3d& p_C) {
  // About C's y (down): to the right; about its x (right): upwards.
  const double right = std::atan2(p_C.x(), p_C.z()) * sense(q, pan_, Eigen::Vector3d::UnitY());
  const double upwards = sense(q, tilt_, Eigen::Vector3d::UnitX());
  const double up = -std::atan2(p_C.y(), p_C.z()) * upwards;
  Eigen::VectorXd q_there = q;
  for (const auto& [dof, by] : {std::pair{pan_, right}, std::pair{tilt_, up}}) {
    for (double turned = 0; turned + kStep <= std::abs(by); turned += kStep) {
      Eigen::VectorXd q_next = q_there;
      q_next[dof] += std::copysign(kStep, by);
      // A head that looks down comes near the shoulders when it turns.
      while (dof == pan_ && !has_room(q_next) && within_limits(q_next, tilt_))
        q_next[tilt_] += kStep * upwards;
      if (!within_limits(q_next, dof) || !has_room(q_next)) break;
      q_there = q_next;
    }
  }
  return q_there;
}

}  // namespace walkman::motion
