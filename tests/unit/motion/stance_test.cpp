#include "adaptation/motion/stance.h"

#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <kdl/treeidsolver_recursive_newton_euler.hpp>

#include "adaptation/motion/body_guard.h"
#include "adaptation/motion/hand_motion.h"
#include "tests/unit/motion/kdl_robot.h"
#include "tests/unit/motion/reference_robot.h"

namespace walkman::motion {
namespace {

constexpr double kDt = 0.005;

class StanceTest : public testing::Test {
 protected:
  StanceTest() : robot(reference_robot()), posed(robot.model, robot.joint_names), stance(robot.model) {
    q = robot.q_home;
    posed.update(q);
    stance.take(posed);
    place();
  }
  void place() {
    posed.update(q);
    posed.set_base(stance.X_TB(posed));
    posed.update(q);
  }
  double& joint(const std::string& name) { return q[posed.dof_of(name)]; }

  const ReferenceRobot& robot;
  KinematicTree posed;
  Stance stance;
  Eigen::VectorXd q;
};

TEST_F(StanceTest, FrameIsLevelWithTheSolesAndAtTheBase) {
  // Any base pose at the time the stance is taken gives the same frame relative to the robot.
  Eigen::Isometry3d X_WB(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 3).normalized()));
  X_WB.translation() << 3, -1, 0.5;
  KinematicTree elsewhere(robot.model, robot.joint_names);
  elsewhere.set_base(X_WB);
  elsewhere.update(q);
  Stance other(robot.model);
  other.take(elsewhere);
  for (int foot = 0; foot < Stance::kFeet; ++foot) {
    EXPECT_TRUE(other.X_TF(foot).isApprox(stance.X_TF(foot), 1e-12));
    EXPECT_NEAR(stance.X_TF(foot).linear()(2, 2), 1, 1e-6);
    EXPECT_NEAR(stance.X_TF(foot).translation().z(), -1.0478, 1e-3);
  }
  EXPECT_LT(stance.X_TB(posed).translation().norm(), 1e-12);
  EXPECT_NEAR(stance.centre().y(), 0, 1e-9);
}

TEST_F(StanceTest, BaseLeansAsTheAnklesDo) {
  const Eigen::Isometry3d X_TF = stance.X_TF(0);
  const double lean = 0.02;
  joint("LAnkSag") += lean;
  joint("RAnkSag") += lean;
  place();
  // Both legs together turn the rest of the robot back about the ankles' axis; the soles stay.
  EXPECT_TRUE(posed.X_WL(stance.sole_link(0)).isApprox(X_TF, 1e-3));
  const Eigen::AngleAxisd turn(posed.X_WB().linear());
  EXPECT_NEAR(turn.angle(), lean, 1e-4);
  EXPECT_NEAR(std::abs(turn.axis().y()), 1, 1e-9);
  const Eigen::Vector3d ankle = posed.X_WL(robot.model.link_index("LFoot")).translation();
  EXPECT_NEAR(std::abs(posed.X_WB().translation().x()), lean * -ankle.z(), 5e-4);
  // One leg alone: the mean of two poses that disagree.
  joint("RAnkSag") -= lean;
  place();
  EXPECT_NEAR(Eigen::AngleAxisd(posed.X_WB().linear()).angle(), lean / 2, 1e-9);
}

TEST_F(StanceTest, SupportsBalanceTheWeight) {
  joint("WaistLat") = 0.1;
  joint("WaistSag") = 0.2;
  place();
  Eigen::Vector3d force = Eigen::Vector3d::Zero(), moment = Eigen::Vector3d::Zero();
  const auto supports = stance.supports(posed);
  for (int foot = 0; foot < Stance::kFeet; ++foot) {
    const Stance::Support& support = supports[static_cast<std::size_t>(foot)];
    const Eigen::Vector3d f(0, 0, support.force);
    EXPECT_GT(support.force, 100);
    force += f;
    moment += (posed.X_WL(stance.sole_link(foot)) * support.p_FP - posed.com()).cross(f);
  }
  EXPECT_NEAR(force.z(), 118.0 * kGravity, 0.01);
  EXPECT_LT(moment.norm(), 1e-9);
}

TEST_F(StanceTest, WeightBeyondAFootIsCarriedByItAlone) {
  posed.set_payload(500, robot.model.link_index("LFoot"), Eigen::Vector3d(0, 1, 0));
  place();
  const auto supports = stance.supports(posed);
  EXPECT_EQ(supports[1].force, 0);
  EXPECT_NEAR(supports[0].force, 618 * kGravity, 0.01);
}

TEST_F(StanceTest, TorquesAgreeWithKdl) {
  const KDL::Tree tree = kdl_tree(robot.model);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> bend(-0.15, 0.15);
  for (int round = 0; round < 5; ++round) {
    std::map<std::string, double> positions;
    for (const char* name : {"WaistLat", "WaistSag", "WaistYaw", "RShSag", "LHipSag", "RHipSag", "LKneeSag",
                             "RKneeSag", "LAnkSag", "RAnkSag", "LHipYaw", "RAnkLat"})
      joint(name) = robot.q_home[posed.dof_of(name)] + bend(random);
    for (std::size_t i = 0; i < robot.joint_names.size(); ++i)
      positions[robot.joint_names[i]] = q[static_cast<Eigen::Index>(i)];
    place();
    const Eigen::Matrix3d R_BT = posed.X_WB().linear().transpose();
    const Eigen::Vector3d g = R_BT * Eigen::Vector3d(0, 0, -kGravity);
    KDL::TreeIdSolver_RNE solver(tree, KDL::Vector(g.x(), g.y(), g.z()));
    KDL::WrenchMap ground;
    const auto supports = stance.supports(posed);
    for (int foot = 0; foot < Stance::kFeet; ++foot) {
      const Stance::Support& support = supports[static_cast<std::size_t>(foot)];
      const Eigen::Matrix3d R_FT = posed.X_WL(stance.sole_link(foot)).linear().transpose();
      const Eigen::Vector3d f = R_FT * Eigen::Vector3d(0, 0, support.force);
      const Eigen::Vector3d t = support.p_FP.cross(f);
      ground[robot.model.links[static_cast<std::size_t>(stance.sole_link(foot))].name] =
          KDL::Wrench(KDL::Vector(f.x(), f.y(), f.z()), KDL::Vector(t.x(), t.y(), t.z()));
    }
    const KDL::JntArray kdl_q = kdl_positions(tree, robot.model, positions);
    const KDL::JntArray zero(tree.getNrOfJoints());
    KDL::JntArray expected(tree.getNrOfJoints());
    ASSERT_GE(solver.CartToJnt(kdl_q, zero, zero, ground, expected), 0);
    Eigen::MatrixXd J(6, posed.dof());
    Eigen::VectorXd torques(posed.dof());
    standing_torques(posed, stance, J, torques);
    for (const auto& [link, element] : tree.getSegments()) {
      const KDL::Joint& described = element.segment.getJoint();
      if (described.getType() == KDL::Joint::None || posed.dof_of(described.getName()) < 0) continue;
      EXPECT_NEAR(torques[posed.dof_of(described.getName())], expected(element.q_nr), 1e-9)
          << described.getName();
    }
    EXPECT_GT(torques.cwiseAbs().maxCoeff(), 30);  // the knees carry the robot
  }
}

/// Whole-body motion with a hand that moves to targets.
class StandingMotionTest : public StanceTest {
 protected:
  StandingMotionTest() : motion(robot.model, robot.joint_names, stance, robot.right) {
    motion.reset(robot.q_home);
    motion.set_obstacles(table());
  }
  static std::vector<NamedObstacle> table() {
    return {{"the table",
             ConvexPrism(Eigen::Vector3d::UnitZ(),
                         {{0.5, -0.8, -0.15}, {1.3, -0.8, -0.15}, {1.3, 0.8, -0.15}, {0.5, 0.8, -0.15}})}};
  }
  void expect_feet_and_balance() const {
    for (int foot = 0; foot < Stance::kFeet; ++foot) {
      const Eigen::Isometry3d& X_TF = motion.kinematics().X_WL(stance.sole_link(foot));
      EXPECT_LT((X_TF.translation() - stance.X_TF(foot).translation()).norm(), 1e-5);
      EXPECT_LT(rotation_error(X_TF.linear(), stance.X_TF(foot).linear()).norm(), 1e-5);
    }
    EXPECT_LT((motion.kinematics().com().head<2>() - motion.com_target()).norm(), 0.005);
    EXPECT_GT(motion.limit_margin(), -1e-9);
  }

  HandMotion motion;
};

TEST_F(StandingMotionTest, ReachesWithItsFeetInPlaceAndInBalance) {
  for (const Eigen::Isometry3d& X_TH :
       {palm_down(0.60, -0.25, 0.10), palm_down(0.70, -0.24, -0.07), palm_down(0.45, -0.45, 0.30)}) {
    motion.go_to(X_TH, {});
    for (int i = 0; i < 4000 && !motion.done(); ++i) {
      motion.step(kDt);
      expect_feet_and_balance();
      EXPECT_LE(motion.v_ref().cwiseAbs().maxCoeff(), 1 + 1e-8);
    }
    EXPECT_EQ(motion.status(), HandMotion::Status::kReached) << motion.describe();
    const Eigen::AngleAxisd tilt(motion.X_WB().linear());
    EXPECT_LT(tilt.angle(), 0.15);
  }
}

// The torso swings about the vertical when the waist stops: the arm stays clear of hips and legs even then.
// The distance is taken in the posture turned about the joint by the same angle.
TEST_F(StandingMotionTest, ASwingingTorsoTakesNoArmAgainstTheLegs) {
  const double swing = GuardMargins{}.turn;
  KinematicTree swung(robot.model, robot.joint_names);
  std::vector<int> moving;
  for (const std::string& name : robot.right.active_joints) moving.push_back(swung.dof_of(name));
  BodyGuard guard(swung, moving, false, robot.model.link_index("RShp"), robot.right.hand_link, "",
                  robot.right.disabled_collisions, {});
  const auto least_after = [&](const std::string& twist) {
    HandMotionOptions options = robot.right;
    options.twist_joint = twist;
    HandMotion at_side(robot.model, robot.joint_names, stance, options);
    double least = BodyGuard::kFarthest;
    for (const double x : {-0.05, 0.05, 0.15}) {
      for (const double z : {-0.35, -0.2, 0.0}) {
        at_side.reset(robot.q_home);
        at_side.go_to(palm_down(x, -0.15, z), {});
        for (int step = 0; step < 6000 && !at_side.done(); ++step) at_side.step(kDt);
        for (const double turn : {-swing, swing}) {
          Eigen::VectorXd turned = at_side.q_ref();
          turned[swung.dof_of("WaistYaw")] += turn;
          swung.update(turned);
          guard.update();
          least = std::min(least, guard.own_clearance());
        }
      }
    }
    return least;
  };
  // After turning, another edge may be the nearest, so not all of the margin is left.
  EXPECT_GT(least_after("WaistYaw"), GuardMargins{}.own / 4);
  EXPECT_LT(least_after(""), 0) << "no target brings the arm near the legs";
}

TEST_F(StandingMotionTest, RunsAheadWithoutMovingAnything) {
  const Eigen::VectorXd before = motion.q_ref();
  const Eigen::Isometry3d X_WB = motion.X_WB();
  const HandMotion::Reach reach = motion.reachable(palm_down(0.60, -0.25, 0.10), {});
  EXPECT_EQ(reach.status, HandMotion::Status::kReached);
  EXPECT_EQ(motion.q_ref(), before);
  EXPECT_EQ(motion.X_WB().matrix(), X_WB.matrix());
  EXPECT_EQ(motion.kinematics().X_WB().matrix(), X_WB.matrix());
  EXPECT_EQ(motion.reachable(palm_down(2, 0, 1), {}).status, HandMotion::Status::kBlocked);
}

// The postures that legs and base tend to determine how the rest of the body moves.
TEST_F(StandingMotionTest, OneThatStoodUpThereGoesTheSameWayFromHere) {
  HandMotion planned(robot.model, robot.joint_names, stance, robot.right);
  const Eigen::Isometry3d X_TH = palm_down(0.45, -0.45, 0.30);
  const auto end_from = [&](const Eigen::VectorXd& q_stood) {
    planned.reset(motion.q_ref(), q_stood);
    EXPECT_EQ(planned.q_stood(), q_stood);
    const HandMotion::Reach reach = planned.reachable(X_TH, {});
    EXPECT_EQ(reach.status, HandMotion::Status::kReached);
    return reach.q;
  };
  motion.set_obstacles({});
  motion.go_to(palm_down(0.70, -0.24, -0.07), {});
  while (!motion.done()) motion.step(kDt);
  const Eigen::VectorXd q_there = end_from(motion.q_stood());
  const Eigen::VectorXd q_anew = end_from(motion.q_ref());
  motion.go_to(X_TH, {});
  while (!motion.done()) motion.step(kDt);
  const double apart = (motion.q_ref() - q_there).cwiseAbs().maxCoeff();
  EXPECT_LT(apart, 0.02);
  EXPECT_GT((motion.q_ref() - q_anew).cwiseAbs().maxCoeff(), 5 * apart);
}

// With the hand back at its starting pose, torso and arm are not at theirs: many postures give the same pose.
TEST_F(StandingMotionTest, ReturnsToThePostureThatItHad) {
  motion.set_obstacles({});
  while (!motion.balanced()) motion.step(kDt);
  const Eigen::VectorXd q_start = motion.q_ref();
  const Eigen::Isometry3d X_TH_start = motion.X_WH();
  for (const Eigen::Isometry3d& X_TH : {palm_down(0.70, 0.05, -0.07), X_TH_start}) {
    motion.go_to(X_TH, {});
    while (!motion.done()) motion.step(kDt);
    ASSERT_EQ(motion.status(), HandMotion::Status::kReached) << motion.describe();
  }
  EXPECT_GT((motion.q_ref() - q_start).cwiseAbs().maxCoeff(), 0.1);
  motion.return_to(q_start);
  for (int i = 0; i < 2000 && !motion.done(); ++i) {
    motion.step(kDt);
    expect_feet_and_balance();
    EXPECT_LE(motion.v_ref().cwiseAbs().maxCoeff(), 1 + 1e-8);
  }
  EXPECT_EQ(motion.status(), HandMotion::Status::kHolding);
  EXPECT_LT((motion.q_ref() - q_start).cwiseAbs().maxCoeff(), 0.0051);
  const Eigen::VectorXd q_there = motion.q_ref();
  for (int i = 0; i < 200; ++i) motion.step(kDt);
  EXPECT_LT((motion.q_ref() - q_there).cwiseAbs().maxCoeff(), 0.02) << "it does not stay";
}

TEST_F(StandingMotionTest, WhatIsInTheWayOfItsPostureIsKeptOff) {
  const auto go = [this](const Eigen::Isometry3d& X_TH) {
    motion.go_to(X_TH, {});
    while (!motion.done()) motion.step(kDt);
    ASSERT_EQ(motion.status(), HandMotion::Status::kReached) << motion.describe();
  };
  motion.set_obstacles({});
  go(palm_down(0.65, -0.30, -0.25));
  const Eigen::VectorXd q_below = motion.q_ref();
  go(palm_down(0.65, -0.30, 0.15));
  motion.set_obstacles(table());
  motion.return_to(q_below);
  for (int i = 0; i < 10000 && !motion.done(); ++i) {
    motion.step(kDt);
    EXPECT_GT(motion.obstacle_clearance(), 0.005);
  }
  EXPECT_EQ(motion.status(), HandMotion::Status::kHolding);
  EXPECT_GT((motion.q_ref() - q_below).cwiseAbs().maxCoeff(), 0.05);
}

// A robot that has bent down has no more room below than from where it stood up.
TEST_F(StandingMotionTest, ItsBaseHasTheRoomThatItHadWhereItStoodUp) {
  motion.set_obstacles({});
  const Eigen::Isometry3d low = palm_down(0.55, -0.30, -0.80);
  const auto go_down = [&] {
    motion.go_to(low, {});
    while (!motion.done()) motion.step(kDt);
    return motion.X_WB().translation().z();
  };
  const double z = go_down();
  const double most = BaseRoomOptions{}.down;
  EXPECT_LT(z, -0.9 * most);
  motion.reset(motion.q_ref(), motion.q_stood());
  EXPECT_GT(go_down(), -most - 1e-3);
  motion.reset(motion.q_ref());
  EXPECT_LT(go_down(), z - 0.5 * most);
}

TEST_F(StandingMotionTest, AHeavyLoadMovesTheBodyBack) {
  motion.go_to(palm_down(0.60, -0.25, 0.10), {});
  while (!motion.done()) motion.step(kDt);
  const double before = motion.X_WB().translation().x();
  for (int i = 0; i < 800; ++i) {
    motion.set_payload(8.0 * std::min(1.0, i / 200.0), Eigen::Vector3d::Zero());
    motion.step(kDt);
  }
  EXPECT_LT((motion.kinematics().com().head<2>() - motion.com_target()).norm(), 1e-3);
  EXPECT_LT(motion.X_WB().translation().x(), before - 0.02);
  EXPECT_LT(motion.error().position, 1e-4);  // the hand stays
  expect_feet_and_balance();
}

TEST_F(StandingMotionTest, FailureHoldsTheReferenceAndSaysSo) {
  for (int i = 0; i < 20; ++i) motion.step(kDt);
  const Eigen::VectorXd before = motion.q_ref();
  Eigen::Isometry3d X_TH = palm_down(0.62, -0.25, 0.1);
  X_TH.translation().x() = std::nan("");
  motion.go_to(X_TH, {});
  for (int i = 0; i < 20; ++i) motion.step(kDt);
  EXPECT_EQ(motion.status(), HandMotion::Status::kIkFailed);
  EXPECT_THAT(motion.describe(), testing::HasSubstr("no solution"));
  EXPECT_LT((motion.q_ref() - before).norm(), 1e-12);
}

}  // namespace
}  // namespace walkman::motion
