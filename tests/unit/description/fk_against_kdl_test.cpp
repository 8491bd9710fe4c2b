#include <random>

#include <gtest/gtest.h>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/frames.hpp>
#include <kdl/tree.hpp>
#include <kdl/treefksolverpos_recursive.hpp>

#include "robots.h"

namespace walkman::testing {
namespace {

KDL::Frame to_kdl(const Eigen::Isometry3d& X) {
  const Eigen::Matrix3d R = X.linear();
  return {KDL::Rotation(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)),
          KDL::Vector(X.translation().x(), X.translation().y(), X.translation().z())};
}

KDL::Joint to_kdl(const Joint& joint) {
  if (joint.type == JointType::kFixed) return KDL::Joint(joint.name, KDL::Joint::Fixed);
  const KDL::Frame F = to_kdl(joint.X_PJ);
  return {joint.name, F.p, F.M * KDL::Vector(joint.axis.x(), joint.axis.y(), joint.axis.z()),
          KDL::Joint::RotAxis};
}

TEST(ForwardKinematics, AgreesWithKdlAtRandomPostures) {
  const RobotModel& model = walkman_model();
  KDL::Tree tree(model.links.front().name);
  for (const Joint& joint : model.joints)
    ASSERT_TRUE(tree.addSegment(KDL::Segment(model.links[static_cast<std::size_t>(joint.child_link)].name,
                                             to_kdl(joint), to_kdl(joint.X_PJ)),
                                model.links[static_cast<std::size_t>(joint.parent_link)].name));
  KDL::TreeFkSolverPos_recursive solver(tree);
  std::mt19937 random(7);
  for (int repetition = 0; repetition < 20; ++repetition) {
    std::map<std::string, double> posture;
    for (const Joint& joint : model.joints) {
      if (joint.type == JointType::kFixed || joint.mimic) continue;
      const bool bounded = joint.type == JointType::kRevolute;
      std::uniform_real_distribution<double> angle(bounded ? joint.limits.lower : -3.1,
                                                   bounded ? joint.limits.upper : 3.1);
      posture[joint.name] = angle(random);
    }
    KDL::JntArray q(tree.getNrOfJoints());
    for (const Joint& joint : model.joints) {
      if (joint.type == JointType::kFixed) continue;
      const double value =
          joint.mimic ? joint.mimic->multiplier * posture.at(joint.mimic->joint) + joint.mimic->offset
                      : posture.at(joint.name);
      q(tree.getSegment(model.links[static_cast<std::size_t>(joint.child_link)].name)->second.q_nr) = value;
    }
    const Posed pose(model, posture);
    for (const Link& link : model.links) {
      KDL::Frame expected;
      ASSERT_GE(solver.JntToCart(q, expected, link.name), 0) << link.name;
      const KDL::Frame got = to_kdl(pose(link.name));
      EXPECT_TRUE(KDL::Equal(got, expected, 1e-10)) << link.name;
    }
  }
}

}  // namespace
}  // namespace walkman::testing
