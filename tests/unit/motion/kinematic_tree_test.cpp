#include "adaptation/motion/kinematic_tree.h"

#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <kdl/treefksolverpos_recursive.hpp>
#include <kdl/treeidsolver_recursive_newton_euler.hpp>
#include <kdl/treejnttojacsolver.hpp>

#include "tests/unit/motion/kdl_robot.h"
#include "tests/unit/motion/reference_robot.h"

namespace walkman::motion {
namespace {

constexpr double kExact = 1e-9;

class KinematicsAgainstKdl : public testing::Test {
 protected:
  KinematicsAgainstKdl()
      : model(reference_robot().model),
        names(reference_robot().joint_names),
        tree(kdl_tree(model)),
        kinematics(model, names) {
    X_WB = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized());
    X_WB.translation() << 0.3, -0.2, 1.1;
    kinematics.set_base(X_WB);
  }

  /// Draws a random posture of the degrees of freedom, with fingers anywhere between open and closed.
  void draw() {
    std::uniform_real_distribution<double> angle(-1.5, 1.5);
    q.resize(kinematics.dof());
    positions.clear();
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      q[i] = angle(random);
      positions[names[static_cast<std::size_t>(i)]] = q[i];
    }
    positions["r_handj_synergy"] = 2 + angle(random);
    kinematics.set_passive("r_handj_synergy", positions["r_handj_synergy"]);
    kinematics.update(q);
    kdl_q = kdl_positions(tree, model, positions);
  }

  Eigen::Isometry3d kdl_pose(const std::string& link) {
    KDL::TreeFkSolverPos_recursive solver(tree);
    KDL::Frame frame;
    EXPECT_GE(solver.JntToCart(kdl_q, frame, link), 0);
    return X_WB * from_kdl(frame);
  }

  Eigen::Vector3d kdl_com() {
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    for (const Link& link : model.links)
      if (link.mass > 0) moment += link.mass * (kdl_pose(link.name) * link.p_LLcm);
    return moment / model.total_mass();
  }

  Eigen::VectorXd kdl_gravity_torques(const KDL::Tree& robot) {
    const Eigen::Vector3d g = X_WB.linear().transpose() * Eigen::Vector3d(0, 0, -kGravity);
    KDL::TreeIdSolver_RNE solver(robot, KDL::Vector(g.x(), g.y(), g.z()));
    KDL::JntArray zero(robot.getNrOfJoints());
    KDL::JntArray torques(robot.getNrOfJoints());
    EXPECT_GE(solver.CartToJnt(kdl_q, zero, zero, KDL::WrenchMap(), torques), 0);
    Eigen::VectorXd result(kinematics.dof());
    for (const auto& [link, element] : robot.getSegments()) {
      const KDL::Joint& joint = element.segment.getJoint();
      if (joint.getType() == KDL::Joint::None || kinematics.dof_of(joint.getName()) < 0) continue;
      result[kinematics.dof_of(joint.getName())] = torques(element.q_nr);
    }
    return result;
  }

  const RobotModel& model;
  const std::vector<std::string>& names;
  KDL::Tree tree;
  KinematicTree kinematics;
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  Eigen::VectorXd q;
  std::map<std::string, double> positions;
  KDL::JntArray kdl_q;
  std::mt19937 random{7};
};

TEST_F(KinematicsAgainstKdl, PosesOfAllLinksAgree) {
  for (int round = 0; round < 3; ++round) {
    draw();
    for (std::size_t i = 0; i < model.links.size(); ++i) {
      const Eigen::Isometry3d& X_WL = kinematics.X_WL(static_cast<int>(i));
      EXPECT_TRUE(X_WL.isApprox(kdl_pose(model.links[i].name), kExact)) << model.links[i].name;
    }
  }
}

TEST_F(KinematicsAgainstKdl, JacobiansAgree) {
  const Eigen::Vector3d p_LP(0.02, -0.03, 0.05);
  for (const char* link : {"r_hand_grasp", "multisense/left_camera_optical_frame", "LFoot", "RElb"}) {
    draw();
    KDL::TreeJntToJacSolver solver(tree);
    KDL::Jacobian kdl_jacobian(tree.getNrOfJoints());
    ASSERT_GE(solver.JntToJac(kdl_q, kdl_jacobian, link), 0);
    // KDL's reference point is the link's origin, its axes are the root's.
    const Eigen::Isometry3d X_BL = X_WB.inverse() * kdl_pose(link);
    const Eigen::Vector3d r = X_BL.linear() * p_LP;
    kdl_jacobian.changeRefPoint(KDL::Vector(r.x(), r.y(), r.z()));
    Eigen::MatrixXd J(6, kinematics.dof());
    kinematics.jacobian(model.link_index(link), p_LP, J);
    for (const auto& [name, element] : tree.getSegments()) {
      const KDL::Joint& joint = element.segment.getJoint();
      if (joint.getType() == KDL::Joint::None || kinematics.dof_of(joint.getName()) < 0) continue;
      const Eigen::VectorXd column = kdl_jacobian.data.col(element.q_nr);
      const int dof = kinematics.dof_of(joint.getName());
      EXPECT_LT((J.col(dof).tail<3>() - X_WB.linear() * column.head<3>()).norm(), kExact)
          << link << joint.getName();
      EXPECT_LT((J.col(dof).head<3>() - X_WB.linear() * column.tail<3>()).norm(), kExact)
          << link << joint.getName();
    }
  }
}

TEST_F(KinematicsAgainstKdl, CentreOfMassAgrees) {
  draw();
  EXPECT_LT((kinematics.com() - kdl_com()).norm(), kExact);
  EXPECT_NEAR(kinematics.total_mass(), 118.0, 1e-3);
}

TEST_F(KinematicsAgainstKdl, GravityTorquesAgree) {
  for (int round = 0; round < 5; ++round) {
    draw();
    Eigen::VectorXd torques(kinematics.dof());
    kinematics.gravity_torques(torques);
    EXPECT_LT((torques - kdl_gravity_torques(tree)).cwiseAbs().maxCoeff(), kExact);
    EXPECT_GT(torques.cwiseAbs().maxCoeff(), 10);
  }
}

TEST_F(KinematicsAgainstKdl, GravityTorquesOfAPayloadAgree) {
  draw();
  const Eigen::Vector3d p_HCm(0.11, -0.035, 0.02);
  KDL::Tree loaded = tree;
  loaded.addSegment(KDL::Segment("payload", KDL::Joint(KDL::Joint::None), KDL::Frame::Identity(),
                                 KDL::RigidBodyInertia(1.7, KDL::Vector(p_HCm.x(), p_HCm.y(), p_HCm.z()))),
                    "r_hand_grasp");
  kinematics.set_payload(1.7, model.link_index("r_hand_grasp"), p_HCm);
  kinematics.update(q);
  Eigen::VectorXd torques(kinematics.dof());
  kinematics.gravity_torques(torques);
  EXPECT_LT((torques - kdl_gravity_torques(loaded)).cwiseAbs().maxCoeff(), kExact);
  EXPECT_NEAR(kinematics.total_mass(), model.total_mass() + 1.7, kExact);
}

TEST_F(KinematicsAgainstKdl, CentreOfMassJacobianIsItsDerivative) {
  draw();
  Eigen::MatrixXd J(3, 6 + kinematics.dof());
  kinematics.floating_com_jacobian(J);
  Eigen::MatrixXd J_fixed(3, kinematics.dof());
  kinematics.com_jacobian(J_fixed);
  EXPECT_EQ(J_fixed, J.rightCols(kinematics.dof()));
  constexpr double kStep = 1e-6;
  const auto com_at = [&](Eigen::Index column, double step) {
    Eigen::VectorXd moved = q;
    Eigen::Isometry3d X = X_WB;
    if (column < 3)
      X.linear() = Eigen::AngleAxisd(step, Eigen::Vector3d::Unit(column)).toRotationMatrix() * X_WB.linear();
    else if (column < 6)
      X.translation()[column - 3] += step;
    else
      moved[column - 6] += step;
    kinematics.set_base(X);
    kinematics.update(moved);
    return kinematics.com();
  };
  for (Eigen::Index column = 0; column < J.cols(); ++column) {
    const Eigen::Vector3d forward = com_at(column, kStep);
    const Eigen::Vector3d backward = com_at(column, -kStep);
    EXPECT_LT((J.col(column) - (forward - backward) / (2 * kStep)).norm(), 1e-8) << column;
  }
}

TEST_F(KinematicsAgainstKdl, FloatingJacobianIsTheDerivativeOfThePose) {
  draw();
  const int link = model.link_index("r_hand_grasp");
  const Eigen::Vector3d p_LP(0.02, -0.03, 0.05);
  Eigen::MatrixXd J(6, 6 + kinematics.dof());
  kinematics.floating_jacobian(link, p_LP, J);
  Eigen::MatrixXd J_fixed(6, kinematics.dof());
  kinematics.jacobian(link, p_LP, J_fixed);
  EXPECT_EQ(J_fixed, J.rightCols(kinematics.dof()));
  const Eigen::Vector3d n_W = Eigen::Vector3d(0.3, -0.5, 0.8).normalized();
  Eigen::VectorXd rate = Eigen::VectorXd::Ones(6 + kinematics.dof());
  kinematics.add_floating_point_rate(link, kinematics.X_WL(link) * p_LP, n_W, 2, rate);
  const Eigen::VectorXd expected = 2 * J.bottomRows<3>().transpose() * n_W;
  EXPECT_LT((rate - Eigen::VectorXd::Ones(rate.size()) - expected).norm(), 1e-12);
  constexpr double kStep = 1e-6;
  for (int column = 0; column < 6; ++column) {
    const auto pose_at = [&](double step) {
      Eigen::Isometry3d X = X_WB;
      if (column < 3)
        X.linear() =
            Eigen::AngleAxisd(step, Eigen::Vector3d::Unit(column)).toRotationMatrix() * X_WB.linear();
      else
        X.translation()[column - 3] += step;
      kinematics.set_base(X);
      kinematics.update(q);
      return kinematics.X_WL(link);
    };
    const Eigen::Isometry3d forward = pose_at(kStep);
    const Eigen::Isometry3d backward = pose_at(-kStep);
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(forward.linear() * backward.linear().transpose()));
    EXPECT_LT((J.col(column).head<3>() - turn.angle() * turn.axis() / (2 * kStep)).norm(), 1e-8);
    EXPECT_LT((J.col(column).tail<3>() - (forward * p_LP - backward * p_LP) / (2 * kStep)).norm(), 1e-8);
  }
}

TEST_F(KinematicsAgainstKdl, MimicJointsOfADegreeOfFreedomMoveWithIt) {
  KinematicTree hand(model, {"r_handj_synergy"});
  const int tip = model.link_index("RFinger2Distal");
  Eigen::VectorXd closure(1);
  closure << 2.5;
  hand.update(closure);
  Eigen::MatrixXd J(6, 1);
  hand.jacobian(tip, Eigen::Vector3d(0, 0, -0.045), J);
  constexpr double kStep = 1e-6;
  const auto tip_at = [&](double step) -> Eigen::Vector3d {
    hand.update(closure.array() + step);
    return hand.X_WL(tip) * Eigen::Vector3d(0, 0, -0.045);
  };
  const Eigen::Vector3d forward = tip_at(kStep);
  const Eigen::Vector3d backward = tip_at(-kStep);
  EXPECT_LT((J.col(0).tail<3>() - (forward - backward) / (2 * kStep)).norm(), 1e-8);
  EXPECT_GT(J.col(0).tail<3>().norm(), 0.01);
}

TEST(KinematicTree, RejectsNamesThatAreNoDegreesOfFreedom) {
  const RobotModel& model = reference_robot().model;
  const auto message_for = [&](const std::vector<std::string>& names) -> std::string {
    try {
      const KinematicTree kinematics(model, names);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(message_for({"RElbow"}), testing::HasSubstr("\"RElbow\" not found"));
  EXPECT_THAT(message_for({"r_arm_ft_joint"}), testing::HasSubstr("is fixed"));
  EXPECT_THAT(message_for({"RElbj", "RElbj"}), testing::HasSubstr("listed twice"));
  EXPECT_THAT(message_for({"RFinger1Flexion1"}), testing::HasSubstr("mimic"));
  KinematicTree kinematics(model, {"RElbj"});
  EXPECT_THROW(kinematics.set_passive("RElbj", 0), std::runtime_error);
  EXPECT_THROW(kinematics.set_passive("RFinger1Flexion1", 0), std::runtime_error);
}

}  // namespace
}  // namespace walkman::motion
