#include "tests/unit/plant/momentum.h"

namespace walkman::tests {

Mechanics mechanics_between(const RobotModel& model, const std::vector<Eigen::Isometry3d>& before,
                            const std::vector<Eigen::Isometry3d>& after, double dt, double gravity) {
  Mechanics sum;
  Eigen::Vector3d about_origin = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    const Link& link = model.links[i];
    if (link.mass <= 0) continue;
    const Eigen::Vector3d p0 = before[i] * link.p_LLcm;
    const Eigen::Vector3d p1 = after[i] * link.p_LLcm;
    const Eigen::Vector3d v = (p1 - p0) / dt;
    const Eigen::Vector3d p = (p0 + p1) / 2;
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(before[i].linear().transpose() * after[i].linear()));
    // The axis of a rotation is the same in the axes of both ends and of the midpoint.
    const Eigen::Matrix3d R =
        before[i].linear() * Eigen::AngleAxisd(turn.angle() / 2, turn.axis()).toRotationMatrix();
    const Eigen::Vector3d w_L = turn.angle() / dt * turn.axis();
    sum.mass += link.mass;
    sum.com += link.mass * p;
    sum.momentum += link.mass * v;
    about_origin += link.mass * p.cross(v) + R * (link.I_LLcm_L * w_L);
    sum.kinetic += 0.5 * link.mass * v.squaredNorm() + 0.5 * w_L.dot(link.I_LLcm_L * w_L);
    sum.potential += link.mass * gravity * (p0.z() + p1.z()) / 2;
  }
  sum.com /= sum.mass;
  sum.spin = about_origin - sum.com.cross(sum.momentum);
  return sum;
}

}  // namespace walkman::tests
