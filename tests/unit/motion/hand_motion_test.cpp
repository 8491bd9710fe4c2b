#include "adaptation/motion/hand_motion.h"

#include <array>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/motion/reference_robot.h"

namespace walkman::motion {
namespace {

constexpr double kDt = 0.005;
using Status = HandMotion::Status;

const std::vector<Eigen::Vector3d> kTable = {
    {0.5, -0.8, 0.9}, {1.3, -0.8, 0.9}, {1.3, 0.8, 0.9}, {0.5, 0.8, 0.9}};

/// Above the table's near edge: on a straight line from home to places above the table, the fingers would hit
/// it.
const Eigen::Isometry3d kOverTheEdge = palm_down(0.42, -0.35, 1.22);

/// What must hold at every step of a run, as observed.
struct Record {
  double time = 0;
  double least_table = 1e9, least_own = 1e9, least_margin = 1e9;
  double peak_velocity = 0;
  int steps = 0, jerks = 0;  // steps beyond the acceleration bound, allowed close to something
};

class HandMotionTest : public testing::Test {
 protected:
  HandMotionTest() : robot(reference_robot()), hand(robot.model, robot.joint_names, robot.X_WB, robot.right) {
    hand.reset(robot.q_home);
    hand.set_obstacles({{"the table", ConvexPrism(Eigen::Vector3d::UnitZ(), kTable)}});
  }

  Record run_until_done(double longest = 60) {
    Record run;
    Eigen::VectorXd v = hand.v_ref();
    while (!hand.done() && run.time < longest) {
      const Eigen::VectorXd q = hand.q_ref();
      hand.step(kDt);
      run.time += kDt;
      EXPECT_LT((hand.q_ref() - q - kDt * hand.v_ref()).norm(), 1e-12);
      run.peak_velocity = std::max(run.peak_velocity, hand.v_ref().cwiseAbs().maxCoeff());
      ++run.steps;
      if ((hand.v_ref() - v).cwiseAbs().maxCoeff() / kDt > robot.right.rates.acceleration + 1e-6) ++run.jerks;
      v = hand.v_ref();
      run.least_table = std::min(run.least_table, hand.obstacle_clearance());
      run.least_own = std::min(run.least_own, hand.own_clearance());
      run.least_margin = std::min(run.least_margin, hand.limit_margin());
    }
    EXPECT_TRUE(hand.done());
    return run;
  }

  void expect_safe(const Record& run) {
    EXPECT_GT(run.least_table, 0.009);
    EXPECT_GT(run.least_own, 0.005);
    EXPECT_GT(run.least_margin, -1e-9);
    EXPECT_LE(run.peak_velocity, 1 + 1e-8);
  }

  const ReferenceRobot& robot;
  HandMotion hand;
};

TEST_F(HandMotionTest, ReachesEveryPlaceOfTheBarFromHome) {
  for (const double x : {0.55, 0.62, 0.70}) {
    for (const double y : {-0.45, -0.35, -0.25, -0.15}) {
      if (x < 0.6 && y > -0.2) continue;  // in front of the belly: the hip obstructs the forearm
      hand.reset(robot.q_home);
      // Around the hip, which is on the straight line to the middle.
      for (const Eigen::Isometry3d& X_WH :
           {palm_down(x - 0.1, std::min(y, -0.35), 1.18), palm_down(x, y, 1.18), palm_down(x, y, 0.98)}) {
        hand.go_to(X_WH, {});
        const Record run = run_until_done();
        expect_safe(run);
        EXPECT_LE(run.jerks, 0.02 * run.steps);
        EXPECT_LT(run.time, 8);
      }
      ASSERT_EQ(hand.status(), Status::kReached) << x << " " << y << ": " << hand.describe();
      EXPECT_LT(hand.error().position, 1e-4);
      EXPECT_LT(hand.error().rotation, 1e-4);
      for (const char* joint : {"WaistLat", "WaistSag", "WaistYaw"})
        EXPECT_LT(std::abs(hand.q_ref()[hand.kinematics().dof_of(joint)]), 0.3);
      // The elbow points outwards, well above the table and to the right of the hand.
      const Eigen::Vector3d p_WElbow = hand.kinematics().X_WL(robot.model.link_index("RElb")).translation();
      EXPECT_GT(p_WElbow.z(), 1.1);
      EXPECT_LT(p_WElbow.y(), y);
    }
  }
}

TEST_F(HandMotionTest, ComesToRestOnTheTarget) {
  hand.go_to(palm_down(0.6, -0.3, 1.1), {});
  run_until_done();
  for (int i = 0; i < 400; ++i) hand.step(kDt);
  EXPECT_EQ(hand.status(), Status::kReached);
  EXPECT_LT(hand.error().position, 1e-6);
  EXPECT_LT(hand.error().rotation, 1e-6);
  EXPECT_LT(hand.v_ref().cwiseAbs().maxCoeff(), 1e-6);
}

TEST_F(HandMotionTest, JointsThatAreNotActiveKeepTheirPlace) {
  hand.go_to(palm_down(0.6, -0.3, 1.1), {});
  run_until_done();
  for (std::size_t i = 0; i < robot.joint_names.size(); ++i) {
    const auto& active = robot.right.active_joints;
    if (std::find(active.begin(), active.end(), robot.joint_names[i]) != active.end()) continue;
    const auto dof = static_cast<Eigen::Index>(i);
    EXPECT_EQ(hand.q_ref()[dof], robot.q_home[dof]) << robot.joint_names[i];
  }
}

TEST_F(HandMotionTest, NeverTouchesTheTableWhateverTheTarget) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0, 1);
  int below = 0;
  int reached = 0;
  hand.go_to(palm_down(0.5, -0.3, 1.15), {});
  run_until_done();
  ASSERT_EQ(hand.status(), Status::kReached);
  const Eigen::VectorXd q_above_edge = hand.q_ref();
  const MotionLimits quick{0.5, 2.0, 1.0, 4.0};
  for (int round = 0; round < 50; ++round) {
    hand.reset(q_above_edge);
    Eigen::Isometry3d X_WH =
        palm_down(0.45 + 0.5 * unit(random), -0.5 + 0.5 * unit(random), 0.7 + 0.5 * unit(random));
    const Eigen::Vector3d tilt(unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5);
    X_WH.linear() = Eigen::AngleAxisd(tilt.norm(), tilt.normalized()).toRotationMatrix() * X_WH.linear();
    hand.go_to(X_WH, quick);
    const Record run = run_until_done();
    expect_safe(run);
    if (X_WH.translation().z() < 0.9 && X_WH.translation().x() > 0.5) {
      ++below;
      EXPECT_EQ(hand.status(), Status::kBlocked);
      EXPECT_GT(hand.X_WH().translation().z(), 0.9);
      // After it has stopped, it stays at rest.
      const Eigen::VectorXd q = hand.q_ref();
      for (int i = 0; i < 100; ++i) hand.step(kDt);
      EXPECT_LT((hand.q_ref() - q).norm(), 0.2);
      EXPECT_EQ(hand.v_ref().norm(), 0);
    } else if (hand.status() == Status::kReached) {
      ++reached;
    }
  }
  EXPECT_GT(below, 10);
  EXPECT_GT(reached, 5);
}

TEST_F(HandMotionTest, NamesTheTableWhenItIsInTheWay) {
  hand.go_to(palm_down(0.5, -0.3, 1.15), {});
  run_until_done();
  hand.go_to(palm_down(0.65, -0.3, 0.80), {});
  run_until_done();
  EXPECT_EQ(hand.status(), Status::kBlocked);
  EXPECT_THAT(hand.describe(), testing::ContainsRegex("the table would touch; the hand ends [0-9]+"));
}

TEST_F(HandMotionTest, StopsAsFarOffTheTableAsItIsTold) {
  hand.go_to(palm_down(0.65, -0.3, 1.15), {});
  run_until_done();
  const Eigen::VectorXd q_over = hand.q_ref();
  for (const double off : {0.012, 0.030, 0.012}) {
    GuardMargins margins;
    margins.arm = off;
    hand.reset(q_over);
    hand.set_margins(margins);
    hand.go_to(palm_down(0.65, -0.3, 0.80), {});
    run_until_done();
    EXPECT_EQ(hand.status(), Status::kBlocked);
    EXPECT_NEAR(hand.obstacle_clearance(), off, 0.003);
  }
}

TEST(HandMotion, AtRestItStaysUntilItsBalanceChanges) {
  const ReferenceRobot& robot = reference_robot();
  const Stance stance = home_stance();
  HandMotion hand(robot.model, robot.joint_names, stance, robot.right);
  hand.reset(robot.q_home);
  for (int i = 0; i < 2000; ++i) hand.step(kDt);
  const Eigen::VectorXd q = hand.q_ref();
  for (int i = 0; i < 200; ++i) hand.step(kDt);
  EXPECT_EQ(hand.q_ref(), q);
  const auto off_centre = [&] { return (hand.kinematics().com().head<2>() - hand.com_target()).norm(); };
  EXPECT_LT(off_centre(), 1e-5);
  const int head = hand.kinematics().dof_of("NeckPitchj");
  hand.place_joint(head, q[head] + 0.5);
  EXPECT_GT(off_centre(), 1e-4);
  for (int i = 0; i < 2000; ++i) hand.step(kDt);
  EXPECT_LT(off_centre(), 1e-5);
  hand.set_payload(3, Eigen::Vector3d(0, -0.035, 0));
  EXPECT_GT(off_centre(), 1e-3);
  for (int i = 0; i < 2000; ++i) hand.step(kDt);
  EXPECT_LT(off_centre(), 1e-5);
  EXPECT_GT((hand.q_ref() - q).norm(), 1e-3);
}

TEST(HandMotion, TheWaistOfARobotThatStandsTurnsUpToSpeedInAPeriodOfItsSway) {
  const ReferenceRobot& robot = reference_robot();
  HandMotion hand(robot.model, robot.joint_names, home_stance(), robot.right);
  hand.reset(robot.q_home);
  const int waist = hand.kinematics().dof_of("WaistYaw");
  int steps = 0, sudden = 0;
  double fastest = 0;
  const double height = hand.X_WH().translation().z();
  for (const double y : {-0.3, -0.7, -0.3}) {
    hand.go_to(palm_down(0.5, y, height + 0.3), {});
    while (!hand.done()) {
      const double before = hand.v_ref()[waist];
      hand.step(kDt);
      const double now = hand.v_ref()[waist];
      fastest = std::max(fastest, std::abs(now));
      ++steps;
      // From 0.3 rad/s to rest, or back, in the 0.6 s period of 1.6 Hz.
      if (std::abs(now - before) / kDt > 0.3 / 0.6 + 1e-6) ++sudden;
    }
  }
  EXPECT_GT(fastest, 0.05);
  EXPECT_LE(sudden, 0.02 * steps);  // more is allowed close to something
}

TEST(HandMotion, NamesTheJointThatStopsIt) {
  const ReferenceRobot& robot = reference_robot();
  HandMotion hand(robot.model, robot.joint_names, robot.X_WB, robot.right);
  hand.reset(robot.q_home);
  const auto run_until_done = [&] {
    for (int i = 0; i < 10000 && !hand.done(); ++i) hand.step(kDt);
  };
  hand.go_to(palm_down(0.5, -0.45, 1.1), {});
  run_until_done();
  ASSERT_EQ(hand.status(), Status::kReached);
  Eigen::Isometry3d X_WH = hand.X_WH();
  // Turning the thumb's side forward brings the elbow to the body.
  X_WH.rotate(Eigen::AngleAxisd(-1.8, Eigen::Vector3d::UnitY()));
  hand.go_to(X_WH, {});
  run_until_done();
  EXPECT_EQ(hand.status(), Status::kBlocked);
  EXPECT_THAT(hand.describe(),
              testing::ContainsRegex("joint [A-Za-z0-9]+ is at its limit of -?[0-9.]+ rad; the "
                                     "hand ends [0-9.]+ mm and [0-9.]+ degrees"));
  // The message is true: that joint is at that limit.
  const std::string said = hand.describe();
  const std::string joint = said.substr(6, said.find(' ', 6) - 6);
  const double at = std::stod(said.substr(said.find("of ") + 3));
  EXPECT_NEAR(hand.q_ref()[hand.kinematics().dof_of(joint)], at, 0.026) << said;  // rounded in the message
}

// A target very slightly beyond the arm's reach is not refused.
TEST_F(HandMotionTest, AMillimetreAndFiveMilliradiansAreReached) {
  hand.set_obstacles({});
  hand.go_to(palm_down(0.6, -0.45, 1.2), {});
  run_until_done();
  Eigen::Isometry3d X_WH = hand.X_WH();
  X_WH.translation().x() += 0.9;
  hand.go_to(X_WH, {});
  run_until_done();
  ASSERT_EQ(hand.status(), Status::kBlocked);
  // From where it came to rest, a target less than a millimetre further is reached, one far beyond is not.
  X_WH = hand.X_WH();
  X_WH.translation().x() += 0.0008;
  hand.go_to(X_WH, {});
  run_until_done();
  EXPECT_EQ(hand.status(), Status::kReached) << hand.describe();
  EXPECT_LT(hand.error().position, 1e-3);
  X_WH.translation().x() += 0.05;
  hand.go_to(X_WH, {});
  run_until_done();
  EXPECT_EQ(hand.status(), Status::kBlocked);
}

// The two arms of the URDF, and everything that the description says about them, are mirror images.
TEST_F(HandMotionTest, TheLeftArmIsTheRightOnesMirrorImage) {
  HandMotion left(robot.model, robot.joint_names, robot.X_WB, robot.left);
  const Eigen::Vector3d mirror(1, -1, 1);
  const auto mirrored = [&](const Eigen::Isometry3d& X_WH) {
    Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
    X.translation() = mirror.cwiseProduct(X_WH.translation());
    // H's x points to the right of either hand: it is not mirrored.
    X.linear() = mirror.asDiagonal() * X_WH.linear() * Eigen::Vector3d(-1, 1, 1).asDiagonal();
    return X;
  };
  left.reset(robot.q_home);
  EXPECT_LT((left.X_WH().matrix() - mirrored(hand.X_WH()).matrix()).norm(), 1e-6);
  std::vector<NamedObstacle> table = {{"the table", ConvexPrism(Eigen::Vector3d::UnitZ(), kTable)}};
  left.set_obstacles(table);
  const Eigen::Isometry3d X_WH = palm_down(0.62, -0.30, 1.05);
  for (const Eigen::Isometry3d& X : {kOverTheEdge, X_WH}) {
    hand.go_to(X, {});
    left.go_to(mirrored(X), {});
    for (int i = 0; i < 2000; ++i) {
      hand.step(kDt);
      left.step(kDt);
    }
  }
  ASSERT_EQ(hand.status(), Status::kReached) << hand.describe();
  ASSERT_EQ(left.status(), Status::kReached) << left.describe();
  EXPECT_LT((left.X_WH().matrix() - mirrored(hand.X_WH()).matrix()).norm(), 2e-3);
  for (std::size_t i = 0; i < robot.right.active_joints.size(); ++i) {
    const auto q = [&](const HandMotion& motion, const HandMotionOptions& options) {
      return motion.q_ref()[motion.kinematics().dof_of(options.active_joints[i])];
    };
    // The chest's collision shape is 0.3 mm off the middle, and one shoulder's range 2 degrees narrower.
    EXPECT_NEAR(std::abs(q(hand, robot.right)), std::abs(q(left, robot.left)), 0.01)
        << robot.right.active_joints[i];
  }
}

TEST_F(HandMotionTest, LooksAheadWithoutMoving) {
  const Eigen::VectorXd q = hand.q_ref();
  const std::array way = {kOverTheEdge, palm_down(0.62, -0.25, 1.05)};
  const auto near = hand.reachable(way, {});
  EXPECT_EQ(near.status, Status::kReached);
  EXPECT_LT(near.error.position, 1e-4);
  EXPECT_GT(near.obstacle_clearance, 0.009);
  const auto far = hand.reachable(palm_down(1.4, -0.25, 1.05), {});
  EXPECT_EQ(far.status, Status::kBlocked);
  EXPECT_GT(far.error.position, 0.05);
  EXPECT_EQ(hand.q_ref(), q);
  EXPECT_EQ(hand.status(), Status::kHolding);
  hand.step(kDt);
  EXPECT_EQ(hand.q_ref(), q);
  // The prediction comes true.
  for (const Eigen::Isometry3d& X_WH : way) {
    hand.go_to(X_WH, {});
    run_until_done();
  }
  EXPECT_EQ(hand.status(), Status::kReached);
  EXPECT_LT((hand.q_ref() - near.q).cwiseAbs().maxCoeff(), 0.1);
}

TEST_F(HandMotionTest, FailureHoldsTheReference) {
  for (int i = 0; i < 20; ++i) hand.step(kDt);
  const Eigen::VectorXd q = hand.q_ref();
  Eigen::Isometry3d X_WH = palm_down(0.62, -0.25, 1.05);
  X_WH.translation().x() = std::nan("");
  hand.go_to(X_WH, {});
  for (int i = 0; i < 20; ++i) {
    const auto& commands = hand.step(kDt);
    for (std::size_t j = 0; j < commands.size(); ++j)
      EXPECT_EQ(commands[j].link_position, q[static_cast<Eigen::Index>(j)]);
  }
  EXPECT_EQ(hand.status(), Status::kIkFailed);
  EXPECT_EQ(hand.q_ref(), q);
  hand.go_to(kOverTheEdge, {});
  run_until_done();
  EXPECT_EQ(hand.status(), Status::kReached);
}

TEST_F(HandMotionTest, FeedForwardCarriesRobotAndPayload) {
  const auto torques = [&] {
    Eigen::VectorXd result(hand.q_ref().size());
    const auto& commands = hand.step(kDt);
    for (std::size_t i = 0; i < commands.size(); ++i)
      result[static_cast<Eigen::Index>(i)] = commands[i].feedforward_torque;
    return result;
  };
  hand.go_to(palm_down(0.62, -0.25, 1.05), {});
  run_until_done();
  for (int i = 0; i < 400; ++i) hand.step(kDt);
  const Eigen::VectorXd empty = torques();
  const Eigen::Vector3d p_HCm(0.1, -0.035, 0);
  hand.set_payload(1.5, p_HCm);
  hand.step(kDt);
  const Eigen::VectorXd loaded = torques();
  // Virtual work: the payload's weight through the Jacobian of its point.
  Eigen::MatrixXd J(6, hand.kinematics().dof());
  hand.kinematics().jacobian(robot.model.link_index("r_hand_grasp"), p_HCm, J);
  const Eigen::VectorXd expected = 1.5 * kGravity * J.row(5).transpose();
  EXPECT_LT((loaded - empty - expected).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_GT(expected.cwiseAbs().maxCoeff(), 3);
}

TEST_F(HandMotionTest, RejectsWhatDoesNotFitTheRobot) {
  EXPECT_THROW(hand.reset(Eigen::VectorXd::Zero(3)), std::runtime_error);
  Eigen::VectorXd q = robot.q_home;
  q[4] = std::nan("");
  EXPECT_THROW(hand.reset(q), std::runtime_error);
  HandMotionOptions options = robot.right;
  options.active_joints.emplace_back("RElbow");
  EXPECT_THROW(HandMotion(robot.model, robot.joint_names, robot.X_WB, options), std::runtime_error);
}

}  // namespace
}  // namespace walkman::motion
