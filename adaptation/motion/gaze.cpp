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
  for (const double pan : {-kPanSway, kPanSway}) {
    for (const double tilt : {-kTiltSway, kTiltSway}) {
      q_out[pan_] = q[pan_] + pan;
      q_out[tilt_] = q[tilt_] + tilt;
      posed_.update(q_out);
      guard_.update();
      if (guard_.own_clearance() <= 0) return false;
    }
  }
  return true;
}

bool Gaze::within_limits(const Eigen::VectorXd& q) const {
  const auto within = [&](int dof) {
    return q[dof] > posed_.limits(dof).lower && q[dof] < posed_.limits(dof).upper;
  };
  return within(pan_) && within(tilt_);
}

double Gaze::beside(const Eigen::VectorXd& q, const Eigen::Vector3d& p_W) {
  posed_.update(q);
  const Eigen::Vector3d p_C = posed_.X_WL(camera_).inverse() * p_W;
  return std::atan2(p_C.head<2>().norm(), p_C.z());
}

double Gaze::upwards(const Eigen::VectorXd& q) {
  Eigen::MatrixXd J(6, posed_.dof());
  posed_.update(q);
  posed_.jacobian(camera_, Eigen::Vector3d::Zero(), J);
  const Eigen::Vector3d right_W = posed_.X_WL(camera_).linear().col(0);
  return std::copysign(kStep, J.col(tilt_).head<3>().dot(right_W));
}

std::vector<Eigen::VectorXd> Gaze::towards(const Eigen::VectorXd& q, const Eigen::Vector3d& p_C) {
  const double up = upwards(q);
  posed_.update(q);
  const Eigen::Vector3d p_W = posed_.X_WL(camera_) * p_C;
  Eigen::VectorXd q_there = q;
  const auto step_nearer = [&](int dof, double step) {
    Eigen::VectorXd q_next = q_there;
    q_next[dof] += step;
    // A head tilted down comes close to the shoulders when it pans.
    while (dof == pan_ && within_limits(q_next) && !has_room(q_next)) q_next[tilt_] += up;
    if (!within_limits(q_next) || !has_room(q_next) || beside(q_next, p_W) >= beside(q_there, p_W))
      return false;
    q_there = q_next;
    return true;
  };
  const auto any_nearer = [&](int dof) { return step_nearer(dof, kStep) || step_nearer(dof, -kStep); };
  double most_up = 0;
  while (any_nearer(pan_) || any_nearer(tilt_))
    most_up = std::max(most_up, (q_there[tilt_] - q[tilt_]) * std::copysign(1, up));
  Eigen::VectorXd q_up = q;
  q_up[tilt_] += std::copysign(most_up, up);
  Eigen::VectorXd q_panned = q_up;
  q_panned[pan_] = q_there[pan_];
  return {q_up, q_panned, q_there};
}

}  // namespace walkman::motion
