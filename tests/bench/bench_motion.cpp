// One cycle of the hand motion and its parts: WALK-MAN with 31 joints, ten of them active, the table in
// place.

#include <numeric>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <benchmark/benchmark.h>

#include "adaptation/motion/hand_motion.h"
#include "urdf/reader/robot_description.h"

namespace {

using namespace walkman;
using namespace walkman::motion;

struct Robot {
  Robot()
      : known(load_robot_description(std::string(WALKMAN_URDF_DIR) + "/walkman.robot.yaml")),
        right(hand_motion_options(known, known.description.hands.front())) {
    const auto home = load_posture(known.description.srdf, "home", model);
    for (const Bus& bus : known.devices.buses)
      for (const Device& device : bus.devices)
        if (device.kind == DeviceKind::kJointDrive) names.push_back(device.name);
    q.resize(static_cast<Eigen::Index>(names.size()));
    for (std::size_t i = 0; i < names.size(); ++i) q[static_cast<Eigen::Index>(i)] = home.at(names[i]);
    X_WB.translation().z() = 1.0498;
  }
  KnownRobot known;
  const RobotModel& model = known.model;
  HandMotionOptions right;
  std::vector<std::string> names;
  Eigen::VectorXd q;
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
};

const Robot& robot() {
  static const Robot instance;
  return instance;
}

/// Moves the arm back and forth between two poses over a table whose top is `top` (m) above W, so that the
/// solves of a whole motion are averaged.
void go_to_and_fro(benchmark::State& state, HandMotion& hand, double top) {
  hand.reset(robot().q);
  hand.set_obstacles(
      {{"the table", ConvexPrism(Eigen::Vector3d::UnitZ(),
                                 {{0.5, -0.8, top}, {1.3, -0.8, top}, {1.3, 0.8, top}, {0.5, 0.8, top}})}});
  const Eigen::Isometry3d X_WHome = hand.X_WH();
  Eigen::Isometry3d X_WGrasp = Eigen::Isometry3d::Identity();
  X_WGrasp.linear() << 0, 0, -1, -1, 0, 0, 0, 1, 0;
  X_WGrasp.translation() << 0.62, -0.25, top + 0.2;
  bool at_home = true;
  for ([[maybe_unused]] auto _ : state) {
    if (hand.done()) {
      hand.go_to(at_home ? X_WGrasp : X_WHome, {});
      at_home = !at_home;
    }
    benchmark::DoNotOptimize(hand.step(0.005).data());
  }
}

void hand_motion_step(benchmark::State& state) {
  HandMotion hand(robot().model, robot().names, robot().X_WB, robot().right);
  go_to_and_fro(state, hand, 0.9);
}
BENCHMARK(hand_motion_step)->Unit(benchmark::kMicrosecond);

/// The same on two feet: 28 variables, five levels, as in the experiments.
void standing_motion_step(benchmark::State& state) {
  KinematicTree posed(robot().model, robot().names);
  posed.update(robot().q);
  Stance stance(robot().model);
  stance.take(posed);
  HandMotion hand(robot().model, robot().names, stance, robot().right);
  go_to_and_fro(state, hand, 0.9 - 1.0478);
}
BENCHMARK(standing_motion_step)->Unit(benchmark::kMicrosecond);

/// 37 variables, five levels: feet, hand, centre of mass, torso, posture.
void floating_whole_body_solve(benchmark::State& state) {
  KinematicTree kinematics(robot().model, robot().names);
  kinematics.set_base(robot().X_WB);
  Eigen::VectorXd q = robot().q;
  kinematics.update(q);
  std::vector<int> all(robot().names.size());
  std::iota(all.begin(), all.end(), 0);
  WholeBodyIk ik(kinematics, BaseMotion::kFloating, all, {});
  const int hand = robot().model.link_index("r_hand_grasp");
  const int left = robot().model.link_index("LFoot");
  const int right = robot().model.link_index("RFoot");
  const Eigen::Isometry3d X_WLeft = kinematics.X_WL(left);
  const Eigen::Isometry3d X_WRight = kinematics.X_WL(right);
  Eigen::Isometry3d X_WH = kinematics.X_WL(hand);
  X_WH.translation() += Eigen::Vector3d(0.2, 0.05, 0.1);
  const Eigen::Matrix<double, 6, 1> still = Eigen::Matrix<double, 6, 1>::Zero();
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  for ([[maybe_unused]] auto _ : state) {
    kinematics.update(q);
    ik.start(q, 0.005);
    ik.next_level();
    ik.track_pose(left, origin, X_WLeft, still, 5);
    ik.track_pose(right, origin, X_WRight, still, 5);
    ik.next_level();
    ik.track_pose(hand, origin, X_WH, still, 1);
    ik.next_level();
    ik.track_com(kinematics.com().head<2>(), Eigen::Vector2d::Zero(), 4);
    ik.next_level();
    ik.track_orientation(robot().model.link_index("DWYTorso"), Eigen::Matrix3d::Identity(), origin, 2);
    ik.next_level();
    for (const int dof : all) ik.track_joint(dof, 0, 1);
    benchmark::DoNotOptimize(ik.solve());
  }
}
BENCHMARK(floating_whole_body_solve)->Unit(benchmark::kMicrosecond);

void kinematics_update(benchmark::State& state) {
  KinematicTree kinematics(robot().model, robot().names);
  for ([[maybe_unused]] auto _ : state) {
    kinematics.update(robot().q);
    benchmark::DoNotOptimize(kinematics.com().data());
  }
}
BENCHMARK(kinematics_update)->Unit(benchmark::kMicrosecond);

}  // namespace
