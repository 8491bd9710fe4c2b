#include "tests/unit/motion/kdl_robot.h"

namespace walkman::motion {
namespace {

KDL::Joint kdl_joint(const Joint& joint) {
  if (joint.type == JointType::kFixed) return KDL::Joint(joint.name, KDL::Joint::None);
  const Eigen::Vector3d axis = joint.X_PJ.linear() * joint.axis;
  const Eigen::Vector3d& p = joint.X_PJ.translation();
  const auto type = joint.type == JointType::kPrismatic ? KDL::Joint::TransAxis : KDL::Joint::RotAxis;
  return KDL::Joint(joint.name, KDL::Vector(p.x(), p.y(), p.z()), KDL::Vector(axis.x(), axis.y(), axis.z()),
                    type);
}

}  // namespace

KDL::Frame to_kdl(const Eigen::Isometry3d& X) {
  KDL::Frame frame;
  for (int r = 0; r < 3; ++r) {
    frame.p(r) = X.translation()[r];
    for (int c = 0; c < 3; ++c) frame.M(r, c) = X.linear()(r, c);
  }
  return frame;
}

Eigen::Isometry3d from_kdl(const KDL::Frame& frame) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  for (int r = 0; r < 3; ++r) {
    X.translation()[r] = frame.p(r);
    for (int c = 0; c < 3; ++c) X.linear()(r, c) = frame.M(r, c);
  }
  return X;
}

KDL::Tree kdl_tree(const RobotModel& model) {
  KDL::Tree tree(model.links.front().name);
  for (const Joint& joint : model.joints) {
    const Link& child = model.links[static_cast<std::size_t>(joint.child_link)];
    const Eigen::Matrix3d& I = child.I_LLcm_L;
    const KDL::RigidBodyInertia inertia(
        child.mass, KDL::Vector(child.p_LLcm.x(), child.p_LLcm.y(), child.p_LLcm.z()),
        KDL::RotationalInertia(I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)));
    tree.addSegment(KDL::Segment(child.name, kdl_joint(joint), to_kdl(joint.X_PJ), inertia),
                    model.links[static_cast<std::size_t>(joint.parent_link)].name);
  }
  return tree;
}

KDL::JntArray kdl_positions(const KDL::Tree& tree, const RobotModel& model,
                            const std::map<std::string, double>& positions) {
  const auto value_of = [&positions](const std::string& name) {
    const auto found = positions.find(name);
    return found == positions.end() ? 0.0 : found->second;
  };
  KDL::JntArray q(tree.getNrOfJoints());
  for (const auto& [link_name, element] : tree.getSegments()) {
    const KDL::Joint& joint = element.segment.getJoint();
    if (joint.getType() == KDL::Joint::None) continue;
    const Joint& described = model.joints[static_cast<std::size_t>(model.joint_index(joint.getName()))];
    q(element.q_nr) = described.mimic ? described.mimic->multiplier * value_of(described.mimic->joint) +
                                            described.mimic->offset
                                      : value_of(described.name);
  }
  return q;
}

}  // namespace walkman::motion
