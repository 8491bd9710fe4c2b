// Readings of the sensors of wrists and ankles, compared with KDL's recursive Newton–Euler on the same
// motion.

#include "emulator/plant/probes/wrench_probe.h"

#include <cmath>
#include <memory>

#include <gtest/gtest.h>
#include <kdl/chainidsolver_recursive_newton_euler.hpp>

#include "emulator/plant/contact/bullet_types.h"
#include "emulator/plant/dynamics/plant_world.h"
#include "emulator/plant/dynamics/row_space_solver.h"
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

/// A sensor of the robot, the first link it carries, and whether the robot's base is free.
struct SensorCase {
  const char* sensor;
  const char* first_carried;
  bool free_base;
};

class SensorWrench : public ::testing::TestWithParam<SensorCase> {
 protected:
  SensorWrench() {
    world_.setGravity(btVector3(0, 0, -kGravity));
    std::vector<std::string> frozen;
    for (const Joint& joint : model_.joints) {
      const bool finger = joint.mimic.has_value();
      if (finger || joint.type == JointType::kContinuous || joint.name.find("handj") != std::string::npos) {
        frozen.push_back(joint.name);
      }
    }
    const SensorCase& c = GetParam();
    const int sensor = model_.link_index(c.sensor);
    std::vector<std::string> cuts;
    if (std::string(c.sensor) == c.first_carried) {
      const int cut = model_.links[static_cast<std::size_t>(sensor)].parent_joint;
      cuts.push_back(model_.joints[static_cast<std::size_t>(cut)].name);
    }
    body_ = std::make_unique<Multibody>(world_, model_, RigidTree(model_, cuts, frozen), !c.free_base,
                                        Eigen::Isometry3d::Identity(), kRobotGroup, 0);
    probe_ = std::make_unique<WrenchProbe>(*body_, sensor, body_->tree().group_of(sensor));
    world_.add_probe(*probe_);
    chain_ = tests::sensor_chain(model_, c.sensor, c.first_carried, moving_);
    if (c.free_base) chain_ = tests::on_free_base(chain_, body_->tree().X_ML(0));
    for (const auto& [name, q] :
         load_posture(std::string(WALKMAN_URDF_DIR) + "/walkman.srdf", "home", model_)) {
      const int link = body_->bullet_link(model_.joint_index(name));
      if (link >= 0) body_->bullet().setJointPos(link, q);
    }
    body_->update_poses();
    for (int i = 0; i < body_->bullet().getNumLinks(); ++i) home_.push_back(body_->bullet().getJointPos(i));
  }

  /// Runs one step with joint torques that hold the home posture, plus `extra` times a sine on every joint.
  /// Returns the largest difference from KDL, N or N·m.
  double step(double time, double extra) {
    btMultiBody& mb = body_->bullet();
    for (int i = 0; i < mb.getNumLinks(); ++i) {
      if (mb.getLink(i).m_dofCount == 0) continue;
      mb.addJointTorque(i, 60 * (home_[static_cast<std::size_t>(i)] - mb.getJointPos(i)) -
                               8 * mb.getJointVel(i) + extra * std::sin(7 * time + i));
    }
    const bool free_base = GetParam().free_base;
    const auto n = static_cast<unsigned>(chain_.getNrOfJoints());
    const unsigned first_joint = free_base ? 6 : 0;
    KDL::JntArray q(n), qd(n), qdd(n), torque(n);
    for (std::size_t i = 0; i < moving_.size(); ++i) {
      const int link = body_->bullet_link(moving_[i]);
      q(first_joint + static_cast<unsigned>(i)) = mb.getJointPos(link);
      qd(first_joint + static_cast<unsigned>(i)) = mb.getJointVel(link);
    }
    tests::BaseMotion base;
    base.X_WM = body_->X_WM(0);
    base.v = from_bullet(mb.getBaseVel());
    base.w = from_bullet(mb.getBaseOmega());
    if (free_base) {
      mb.addBaseForce(extra * btVector3(60 * std::sin(9 * time), 40, mb_weight_ / extra));
      mb.addBaseTorque(extra * btVector3(4 * std::sin(11 * time), 3 * std::cos(8 * time), 2));
    }
    world_.stepSimulation(kStep, 0);
    base.v_rate = (from_bullet(mb.getBaseVel()) - base.v) / kStep;
    base.w_rate = (from_bullet(mb.getBaseOmega()) - base.w) / kStep;
    if (free_base) tests::base_joints(base, q, qd, qdd);
    turned_ = std::max(turned_, base.w.norm());
    for (std::size_t i = 0; i < moving_.size(); ++i) {
      const auto k = first_joint + static_cast<unsigned>(i);
      qdd(k) = (mb.getJointVel(body_->bullet_link(moving_[i])) - qd(k)) / kStep;
      fastest_ = std::max(fastest_, std::abs(qd(k)));
    }
    KDL::ChainIdSolver_RNE solver(chain_, KDL::Vector(0, 0, -kGravity));
    EXPECT_EQ(solver.CartToJnt(q, qd, qdd, KDL::Wrenches(chain_.getNrOfSegments()), torque), 0);
    double worst = 0;
    for (unsigned axis = 0; axis < 3; ++axis) {
      const unsigned first = n - 6;
      // The solver returns what the arm exerts on the hand; the sensor reads the reaction.
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
  double fastest_ = 0, turned_ = 0, force_ = 0;
  const double mb_weight_ = kGravity * model_.total_mass();
};

TEST_P(SensorWrench, InMotionIsKdls) {
  double squares = 0;
  double most = 0, least = 1e9;
  constexpr int kSteps = 3000;
  for (int i = 0; i < kSteps; ++i) {
    const double difference = step(i * kStep, 12);
    squares += difference * difference;
    most = std::max(most, force_);
    least = std::min(least, force_);
  }
  EXPECT_LT(std::sqrt(squares / kSteps), 1e-9);
  EXPECT_GT(fastest_, 1.0);     // rad/s: the joints moved
  EXPECT_GT(most - least, 10);  // N: and the motion loaded the sensor
  if (GetParam().free_base) {
    EXPECT_GT(turned_, 0.5);
  }  // rad/s
}

INSTANTIATE_TEST_SUITE_P(
    EverySensor, SensorWrench,
    ::testing::Values(SensorCase{"r_arm_ft", "r_arm_ft", false}, SensorCase{"l_arm_ft", "l_arm_ft", false},
                      SensorCase{"r_leg_ft", "RFoot", false}, SensorCase{"l_leg_ft", "LFoot", false},
                      SensorCase{"r_arm_ft", "r_arm_ft", true}, SensorCase{"l_arm_ft", "l_arm_ft", true},
                      SensorCase{"r_leg_ft", "RFoot", true}, SensorCase{"l_leg_ft", "LFoot", true}),
    [](const auto& test) {
      return std::string(test.param.sensor) + (test.param.free_base ? "_on_a_free_base" : "_on_a_fixed_base");
    });

class WristWrench : public SensorWrench {};

TEST_P(WristWrench, OfALoadHeldStillIsKdls) {
  double worst = 0;
  for (int i = 0; i < 8000; ++i) worst = std::max(worst, step(i * kStep, 0));
  EXPECT_LT(worst, 1e-9);
  EXPECT_NEAR(force_, 2.7 * kGravity, 0.2);  // hand 1.2 kg and load 1.5 kg, almost at rest by now
}

INSTANTIATE_TEST_SUITE_P(FixedBase, WristWrench,
                         ::testing::Values(SensorCase{"r_arm_ft", "r_arm_ft", false}));

}  // namespace
}  // namespace walkman::plant
