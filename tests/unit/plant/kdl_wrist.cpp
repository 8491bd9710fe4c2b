#include "tests/unit/plant/kdl_wrist.h"

#include <algorithm>

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

/// Inertia of a link and all it carries with every joint at zero, in the link's frame.
KDL::RigidBodyInertia inertia_below(const RobotModel& model, int link) {
  KDL::RigidBodyInertia sum = inertia(model.links[static_cast<std::size_t>(link)]);
  for (const Joint& joint : model.joints) {
    if (joint.parent_link == link) sum = sum + frame(joint.X_PJ) * inertia_below(model, joint.child_link);
  }
  return sum;
}

}  // namespace

KDL::Chain wrist_chain(const RobotModel& model, const std::string& sensor_frame, std::vector<int>& moving) {
  std::vector<int> path;  // joints from the sensor back to the root
  for (int link = model.link_index(sensor_frame);
       model.links[static_cast<std::size_t>(link)].parent_joint >= 0;) {
    path.push_back(model.links[static_cast<std::size_t>(link)].parent_joint);
    link = model.joints[static_cast<std::size_t>(path.back())].parent_link;
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
    // KDL turns a joint before a segment's own frame, so the joint sits in a segment of its own.
    chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), frame(joint.X_PJ)));
    chain.addSegment(KDL::Segment(KDL::Joint(KDL::Vector::Zero(), vector(joint.axis), KDL::Joint::RotAxis)));
  }
  for (const auto type :
       {KDL::Joint::TransX, KDL::Joint::TransY, KDL::Joint::TransZ, KDL::Joint::RotX, KDL::Joint::RotY}) {
    chain.addSegment(KDL::Segment(KDL::Joint(type)));
  }
  chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::RotZ), KDL::Frame::Identity(),
                                inertia_below(model, model.link_index(sensor_frame))));
  return chain;
}

}  // namespace walkman::tests
