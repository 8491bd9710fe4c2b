// The wrist's wrench against KDL's recursive Newton–Euler on the same motion.

#include "emulator/plant/wrench_probe.h"

#include <cmath>
#include <memory>

#include <gtest/gtest.h>
#include <kdl/chainidsolver_recursive_newton_euler.hpp>

#include "emulator/plant/row_space_solver.h"
#include "tests/unit/plant/kdl_wrist.h"

namespace walkman::plant {
namespace {

constexpr double kStep = 1e-3;
constexpr double kGravity = 9.81;

/// The robot with a 1.5 kg load in its right hand, 12 cm beside the palm.
RobotModel loaded_robot() {
  RobotModel model = load_robot_model(std::string(WALKMAN_URDF_DIR) + "/walkman.urdf");
  Link& hand = model.links[static_cast<std::size_t>(model.link_index("RSoftHandLink"))];
  Link load;
  load.name = "load";
  load.mass = 1.5;
  load.p_LLcm = {0.12, 0.03, -0.21};
  load.I_LLcm_L = Eigen::Vector3d(0.002, 0.13, 0.13).asDiagonal();
  const Eigen::Vector3d com = (hand.mass * hand.p_LLcm + load.mass * load.p_LLcm) / (hand.mass + load.mass);
  const auto about = [&](const Link& link) {
    const Eigen::Vector3d d = link.p_LLcm - com;
    return Eigen::Matrix3d(link.I_LLcm_L +
                           link.mass * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose()));
  };
  hand.I_LLcm_L = about(hand) + about(load);
  hand.p_LLcm = com;
  hand.mass += load.mass;
  return model;
}

class WristWrench : public ::testing::Test {
 protected:
  WristWrench() {
    world_.setGravity(btVector3(0, 0, -kGravity));
    std::vector<std::string> frozen;
    for (const Joint& joint : model_.joints) {
      const bool finger = joint.mimic.has_value();
      if (finger || joint.type == JointType::kContinuous || joint.name.find("handj") != std::string::npos) {
        frozen.push_back(joint.name);
      }
    }
    const int sensor = model_.link_index("r_arm_ft");
    const int cut = model_.links[static_cast<std::size_t>(sensor)].parent_joint;
    RigidTree tree(model_, {model_.joints[static_cast<std::size_t>(cut)].name}, frozen);
    body_ = std::make_unique<Multibody>(world_, model_, std::move(tree), true, Eigen::Isometry3d::Identity(),
                                        kRobotGroup, 0, std::vector<Surface>(model_.links.size()));
    probe_ = std::make_unique<WrenchProbe>(*body_, sensor, body_->tree().group_of(sensor));
    world_.add_probe(*probe_);
    chain_ = tests::wrist_chain(model_, "r_arm_ft", moving_);
    for (const auto& [name, q] :
         load_posture(std::string(WALKMAN_URDF_DIR) + "/walkman.srdf", "home", model_)) {
      const int link = body_->bullet_link(model_.joint_index(name));
      if (link >= 0) body_->bullet().setJointPos(link, q);
    }
    body_->update_poses();
    for (int i = 0; i < body_->bullet().getNumLinks(); ++i) home_.push_back(body_->bullet().getJointPos(i));
  }

  /// One step with joint torques that hold the home posture, plus `extra` times a sine on every joint.
  /// Returns the largest difference to KDL, N or N·m.
  double step(double time, double extra) {
    btMultiBody& mb = body_->bullet();
    for (int i = 0; i < mb.getNumLinks(); ++i) {
      if (mb.getLink(i).m_dofCount == 0) continue;
      mb.addJointTorque(i, 60 * (home_[static_cast<std::size_t>(i)] - mb.getJointPos(i)) -
                               8 * mb.getJointVel(i) + extra * std::sin(7 * time + i));
    }
    const auto n = static_cast<unsigned>(chain_.getNrOfJoints());
    KDL::JntArray q(n), qd(n), qdd(n), torque(n);
    for (std::size_t i = 0; i < moving_.size(); ++i) {
      const int link = body_->bullet_link(moving_[i]);
      q(static_cast<unsigned>(i)) = mb.getJointPos(link);
      qd(static_cast<unsigned>(i)) = mb.getJointVel(link);
    }
    world_.stepSimulation(kStep, 0);
    for (std::size_t i = 0; i < moving_.size(); ++i) {
      const auto k = static_cast<unsigned>(i);
      qdd(k) = (mb.getJointVel(body_->bullet_link(moving_[i])) - qd(k)) / kStep;
      fastest_ = std::max(fastest_, std::abs(qd(k)));
    }
    KDL::ChainIdSolver_RNE solver(chain_, KDL::Vector(0, 0, -kGravity));
    EXPECT_EQ(solver.CartToJnt(q, qd, qdd, KDL::Wrenches(chain_.getNrOfSegments()), torque), 0);
    double worst = 0;
    for (unsigned axis = 0; axis < 3; ++axis) {
      const unsigned first = n - 6;
      // The solver gives what the arm exerts on the hand; the sensor reads the reaction.
      worst = std::max(worst, std::abs(probe_->F_So_S().force[axis] + torque(first + axis)));
      worst = std::max(worst, std::abs(probe_->F_So_S().torque[axis] + torque(first + 3 + axis)));
    }
    force_ = probe_->F_So_S().force.norm();
    return worst;
  }

  RobotModel model_ = loaded_robot();
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  RowSpaceSolver solver_;
  PlantWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  std::unique_ptr<Multibody> body_;
  std::unique_ptr<WrenchProbe> probe_;
  std::vector<double> home_;
  std::vector<int> moving_;
  KDL::Chain chain_;
  double fastest_ = 0, force_ = 0;
};

TEST_F(WristWrench, OfALoadHeldStillIsKdls) {
  double worst = 0;
  for (int i = 0; i < 8000; ++i) worst = std::max(worst, step(i * kStep, 0));
  EXPECT_LT(worst, 1e-9);
  EXPECT_NEAR(force_, 2.7 * kGravity, 0.2);  // hand 1.2 kg and load 1.5 kg, nearly at rest by now
}

TEST_F(WristWrench, OfALoadInMotionIsKdls) {
  double worst = 0;
  double most = 0, least = 1e9;
  for (int i = 0; i < 3000; ++i) {
    worst = std::max(worst, step(i * kStep, 12));
    most = std::max(most, force_);
    least = std::min(least, force_);
  }
  EXPECT_LT(worst, 1e-9);
  EXPECT_GT(fastest_, 1.0);     // rad/s: there was motion
  EXPECT_GT(most - least, 10);  // N: and it loaded the wrist
}

}  // namespace
}  // namespace walkman::plant
