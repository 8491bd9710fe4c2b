// The plant's parts against MuJoCo, another engine with the same model: without contact they must agree to
// rounding, on the ground in what physics determines.

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "emulator/scene/scene.h"
#include "tests/peers/twin.h"

namespace walkman::peers {
namespace {

/// Root mean square and greatest norm of a series of differences.
class Difference {
 public:
  void add(const Eigen::Vector3d& difference) {
    sum_ += difference.squaredNorm();
    most_ = std::max(most_, difference.norm());
    ++count_;
  }
  [[nodiscard]] double rms() const { return std::sqrt(sum_ / static_cast<double>(count_)); }
  [[nodiscard]] double most() const { return most_; }

 private:
  double sum_ = 0, most_ = 0;
  long count_ = 0;
};

/// The robot with a rigid 1.5 kg load in its right hand, 12 cm beside the palm.
RobotModel loaded_robot(const std::string& urdf) {
  RobotModel model = load_robot_model(urdf);
  Link load;
  load.name = "load";
  load.mass = 1.5;
  load.p_LLcm = {0.12, 0.03, -0.21};
  load.I_LLcm_L << 0.02, 0.0004, -0.0002, 0.0004, 0.13, 0.001, -0.0002, 0.001, 0.13;
  Joint clamp;
  clamp.name = "load_clamp";
  clamp.parent_link = model.link_index("RSoftHandLink");
  clamp.child_link = static_cast<int>(model.links.size());
  load.parent_joint = static_cast<int>(model.joints.size());
  model.links.push_back(load);
  model.joints.push_back(clamp);
  return model;
}

class BesideMujoco : public ::testing::Test {
 protected:
  const std::string urdf_ = WALKMAN_URDF_DIR;
  const Scene scene_ = load_scene(urdf_ + "/scenes/experiment_1.yaml");
  const RobotModel robot_ = loaded_robot(urdf_ + "/walkman.urdf");
  const DeviceTable devices_ = load_device_table(scene_.robot.device_table, robot_);

  [[nodiscard]] TwinOptions options(bool fixed_base) const {
    TwinOptions options;
    options.fixed_base = fixed_base;
    options.X_WR = scene_.X_WB;
    options.posture = load_posture(scene_.robot.srdf, scene_.posture, robot_);
    return options;
  }
};

TEST_F(BesideMujoco, WrenchesOfARigidLoadInMotionAgree) {
  Twin twin(robot_, devices_, options(true));
  for (JointLaw& law : twin.laws()) law = {60, 8, 12};
  std::vector<Difference> force(4), torque(4);
  Difference position;
  double least = 1e9, most = 0, fastest = 0;
  for (int i = 0; i < 6000; ++i) {
    twin.step_bullet();
    twin.step_mujoco();
    for (std::size_t s = 0; s < 4; ++s) {
      force[s].add(twin.bullet_wrench(s).force - twin.mujoco_wrench(s).force);
      torque[s].add(twin.bullet_wrench(s).torque - twin.mujoco_wrench(s).torque);
    }
    const RobotState bullet = twin.bullet_state();
    const RobotState mujoco = twin.mujoco_state();
    for (std::size_t j = 0; j < bullet.q.size(); ++j) {
      position.add({bullet.q[j] - mujoco.q[j], 0, 0});
      fastest = std::max(fastest, std::abs(bullet.v[j]));
    }
    least = std::min(least, twin.bullet_wrench(0).force.norm());
    most = std::max(most, twin.bullet_wrench(0).force.norm());
  }
  for (std::size_t s = 0; s < 4; ++s) {
    EXPECT_LT(force[s].rms(), 1e-6) << "N, sensor " << s;
    EXPECT_LT(torque[s].rms(), 1e-6) << "N·m, sensor " << s;
    std::printf("sensor %zu: rms %.1e N, %.1e N·m; largest %.1e N, %.1e N·m\n", s, force[s].rms(),
                torque[s].rms(), force[s].most(), torque[s].most());
  }
  EXPECT_LT(position.most(), 1e-9);  // rad, after 6 s of motion
  std::printf("joints: largest %.1e rad; wrist force %.1f to %.1f N, joints up to %.1f rad/s\n",
              position.most(), least, most, fastest);
  EXPECT_GT(fastest, 1.0);
  EXPECT_GT(most - least, 10);
}

TEST_F(BesideMujoco, FreeFloatingRobotAcceleratesAlike) {
  Twin twin(robot_, devices_, options(false));
  for (JointLaw& law : twin.laws()) law = {60, 8, 12};
  Difference linear, angular, position, force;
  double turning = 0, shaken = 0;
  for (int i = 0; i < 2000; ++i) {
    const RobotState bullet_before = twin.bullet_state();
    const RobotState mujoco_before = twin.mujoco_state();
    twin.step_bullet();
    twin.step_mujoco();
    const RobotState bullet = twin.bullet_state();
    const RobotState mujoco = twin.mujoco_state();
    const auto rate = [](const Eigen::Vector3d& after, const Eigen::Vector3d& before) {
      return Eigen::Vector3d((after - before) / Twin::kStep);
    };
    const Eigen::Vector3d acceleration = rate(bullet.v_WBcm, bullet_before.v_WBcm);
    linear.add(acceleration - rate(mujoco.v_WBcm, mujoco_before.v_WBcm));
    angular.add(rate(bullet.w_WB, bullet_before.w_WB) - rate(mujoco.w_WB, mujoco_before.w_WB));
    position.add(bullet.p_WBcm - mujoco.p_WBcm);
    force.add(twin.bullet_wrench(0).force - twin.mujoco_wrench(0).force);
    turning = std::max(turning, bullet.w_WB.norm());
    shaken = std::max(shaken, (acceleration + Twin::kGravity * Eigen::Vector3d::UnitZ()).norm());
  }
  EXPECT_LT(linear.rms(), 1e-6);   // m/s²
  EXPECT_LT(angular.rms(), 1e-6);  // rad/s²
  EXPECT_LT(position.most(), 1e-9);
  EXPECT_LT(force.rms(), 1e-6);
  EXPECT_GT(turning, 0.1);  // rad/s: the arms turned the pelvis
  EXPECT_GT(shaken, 0.5);   // m/s² in addition to the fall
  std::printf("base: rms %.1e m/s², %.1e rad/s²; largest %.1e m after 2 s; turned with %.2f rad/s\n",
              linear.rms(), angular.rms(), position.most(), turning);
}

TEST_F(BesideMujoco, StandingRobotsWeighTheSameAtTheSameHeight) {
  TwinOptions o = options(false);
  o.ground = true;
  Twin twin(robot_, devices_, o);
  twin.hold_posture(robot_, devices_, 0);
  for (int i = 0; i < 3000; ++i) {
    twin.step_bullet();
    twin.step_mujoco();
  }
  const RobotState bullet = twin.bullet_state();
  const RobotState mujoco = twin.mujoco_state();
  EXPECT_LT((bullet.p_WBcm - mujoco.p_WBcm).norm(), 2e-3);
  EXPECT_EQ(twin.bullet_contacts(), 8);  // the corners of two soles
  EXPECT_EQ(twin.mujoco_contacts(), 8);
  // Each ankle carries everything above the feet; the sensors are level, as the soles are.
  const double feet = robot_.links[static_cast<std::size_t>(robot_.link_index("RFoot"))].mass +
                      robot_.links[static_cast<std::size_t>(robot_.link_index("LFoot"))].mass;
  const double weight = (robot_.total_mass() - feet) * Twin::kGravity;
  const double by_bullet = twin.bullet_wrench(2).force.z() + twin.bullet_wrench(3).force.z();
  const double by_mujoco = twin.mujoco_wrench(2).force.z() + twin.mujoco_wrench(3).force.z();
  EXPECT_NEAR(by_bullet, weight, 0.005 * weight);
  EXPECT_NEAR(by_mujoco, weight, 0.005 * weight);
  std::printf("base %.2f mm apart; ankles %.1f and %.1f N, weight above them %.1f N\n",
              1e3 * (bullet.p_WBcm - mujoco.p_WBcm).norm(), by_bullet, by_mujoco, weight);
}

}  // namespace
}  // namespace walkman::peers
