#include "tests/unit/plant/kdl_wrist.h"

#include <algorithm>
#include <cmath>

namespace walkman::tests {
namespace {

KDL::Vector vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

KDL::Frame frame(const Eigen::Isometry3d& X) {
  const Eigen::Matrix3d R = X.linear();
  return {KDL::Rotation(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)),
          vector(X.translation())};
}

KDL::RigidBodyInertia inertia(const Link& link) {
  const Eigen::Matrix3d& I = link.I_LLcm_L;
  return KDL::RigidBodyInertia(link.mass, vector(link.p_LLcm),
                               KDL::RotationalInertia(I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)));
}

/// Inertia of a link and everything it carries with every joint at zero, in the link's frame.
KDL::RigidBodyInertia inertia_below(const RobotModel& model, int link) {
  KDL::RigidBodyInertia sum = inertia(model.links[static_cast<std::size_t>(link)]);
  for (const Joint& joint : model.joints) {
    if (joint.parent_link == link) sum = sum + frame(joint.X_PJ) * inertia_below(model, joint.child_link);
  }
  return sum;
}

}  // namespace

KDL::Chain sensor_chain(const RobotModel& model, const std::string& sensor_frame,
                        const std::string& first_carried, std::vector<int>& moving) {
  Eigen::Isometry3d X_CS = Eigen::Isometry3d::Identity();  // the sensor in the frame of what it carries
  const int carried = model.link_index(first_carried);
  std::vector<int> path;  // joints from the sensor back to the root
  for (int link = model.link_index(sensor_frame);
       model.links[static_cast<std::size_t>(link)].parent_joint >= 0;) {
    path.push_back(model.links[static_cast<std::size_t>(link)].parent_joint);
    link = model.joints[static_cast<std::size_t>(path.back())].parent_link;
  }
  for (int link = model.link_index(sensor_frame); link != carried;) {
    const Joint& joint =
        model.joints[static_cast<std::size_t>(model.links[static_cast<std::size_t>(link)].parent_joint)];
    X_CS = joint.X_PJ * X_CS;
    link = joint.parent_link;
  }
  std::reverse(path.begin(), path.end());
  KDL::Chain chain;
  moving.clear();
  for (const int index : path) {
    const Joint& joint = model.joints[static_cast<std::size_t>(index)];
    if (joint.type == JointType::kFixed) {
      chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), frame(joint.X_PJ)));
      continue;
    }
    moving.push_back(index);
    // KDL rotates a joint before its segment's own frame, so the joint gets a segment of its own.
    chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), frame(joint.X_PJ)));
    chain.addSegment(KDL::Segment(KDL::Joint(KDL::Vector::Zero(), vector(joint.axis), KDL::Joint::RotAxis)));
  }
  for (const auto type :
       {KDL::Joint::TransX, KDL::Joint::TransY, KDL::Joint::TransZ, KDL::Joint::RotX, KDL::Joint::RotY}) {
    chain.addSegment(KDL::Segment(KDL::Joint(type)));
  }
  chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::RotZ), KDL::Frame::Identity(),
                                frame(X_CS.inverse()) * inertia_below(model, carried)));
  return chain;
}

KDL::Chain on_free_base(const KDL::Chain& chain, const Eigen::Isometry3d& X_MR) {
  KDL::Chain free;
  for (const auto type : {KDL::Joint::TransX, KDL::Joint::TransY, KDL::Joint::TransZ, KDL::Joint::RotZ,
                          KDL::Joint::RotY, KDL::Joint::RotX}) {
    free.addSegment(KDL::Segment(KDL::Joint(type)));
  }
  free.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), frame(X_MR)));
  free.addChain(chain);
  return free;
}

void base_joints(const BaseMotion& motion, KDL::JntArray& q, KDL::JntArray& qd, KDL::JntArray& qdd) {
  const Eigen::Matrix3d R = motion.X_WM.linear();
  // R = Rz(a) Ry(b) Rx(c).
  const double a = std::atan2(R(1, 0), R(0, 0));
  const double b = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  const double c = std::atan2(R(2, 1), R(2, 2));
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d y(-std::sin(a), std::cos(a), 0);
  const Eigen::Vector3d x = R.col(0);
  Eigen::Matrix3d axes;
  axes << z, y, x;
  const auto solve = axes.partialPivLu();
  const Eigen::Vector3d rate = solve.solve(motion.w);
  const Eigen::Vector3d turning_y = rate[0] * z;
  const Eigen::Vector3d turning_x = turning_y + rate[1] * y;
  const Eigen::Vector3d second =
      solve.solve(motion.w_rate - turning_y.cross(y) * rate[1] - turning_x.cross(x) * rate[2]);
  const Eigen::Vector3d angles(a, b, c);
  for (unsigned i = 0; i < 3; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    q(i) = motion.X_WM.translation()[k];
    qd(i) = motion.v[k];
    qdd(i) = motion.v_rate[k];
    q(i + 3) = angles[k];
    qd(i + 3) = rate[k];
    qdd(i + 3) = second[k];
  }
}

}  // namespace walkman::tests
