// Motion without external forces: energy of a swinging limb, momentum of a body in free flight.

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include <gtest/gtest.h>

#include "emulator/plant/dynamics/plant_world.h"
#include "emulator/plant/dynamics/row_space_solver.h"
#include "emulator/plant/plant.h"
#include "tests/unit/plant/momentum.h"

namespace walkman::plant {
namespace {

constexpr double kStep = Plant::kStep;
constexpr double kGravity = Plant::kGravity;

/// A model in the product's world, with nothing acting on its joints.
class Limp {
 public:
  Limp(RobotModel model, const std::vector<std::string>& free, bool held,
       const Eigen::Isometry3d& X_WR = Eigen::Isometry3d::Identity())
      : model_(std::move(model)) {
    world_.setGravity(btVector3(0, 0, -kGravity));
    world_.use_mid_step_velocities();  // as the plant does
    std::vector<std::string> frozen;
    for (const Joint& joint : model_.joints) {
      if (std::find(free.begin(), free.end(), joint.name) == free.end()) frozen.push_back(joint.name);
    }
    body_ = std::make_unique<Multibody>(world_, model_, RigidTree(model_, {}, frozen), held, X_WR,
                                        kRobotGroup, 0);
  }
  void set(const std::string& joint, double position, double rate = 0) {
    const int link = body_->bullet_link(model_.joint_index(joint));
    body_->bullet().setJointPos(link, position);
    body_->bullet().setJointVel(link, rate);
    body_->update_poses();
  }
  [[nodiscard]] std::vector<Eigen::Isometry3d> poses() const {
    std::vector<Eigen::Isometry3d> poses;
    for (std::size_t i = 0; i < model_.links.size(); ++i) poses.push_back(body_->X_WL(static_cast<int>(i)));
    return poses;
  }
  tests::Mechanics step() {
    const auto before = poses();
    world_.stepSimulation(kStep, 0);
    return tests::mechanics_between(model_, before, poses(), kStep, kGravity);
  }
  [[nodiscard]] Multibody& body() { return *body_; }

 private:
  RobotModel model_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  RowSpaceSolver solver_;
  PlantWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  std::unique_ptr<Multibody> body_;
};

/// Change of a swinging limb's energy over `seconds`, mean of the last second minus mean of the first, as a
/// share of its swing energy above `bottom`, its lowest potential energy. `most` receives the largest
/// deviation of any step from the first.
double energy_drift(Limp& limb, double seconds, double bottom, double& most) {
  std::vector<double> energy;
  double fastest = 0;
  for (int i = 0; i < static_cast<int>(seconds / kStep); ++i) {
    const tests::Mechanics m = limb.step();
    energy.push_back(m.energy());
    fastest = std::max(fastest, m.kinetic);
  }
  const double swing = energy.front() - bottom;
  EXPECT_GT(fastest, 0.8 * swing);  // it does swing
  most = 0;
  for (const double e : energy) most = std::max(most, std::abs(e - energy.front()) / swing);
  const auto mean = [](auto first, auto last) {
    return std::accumulate(first, last, 0.0) / static_cast<double>(last - first);
  };
  return (mean(energy.end() - 1000, energy.end()) - mean(energy.begin(), energy.begin() + 1000)) / swing;
}

const std::string kPendulum = WALKMAN_TEST_DATA "/plant/pendulum.urdf";
// Hanging straight down: centres of mass 0.2 and 0.55 m below the shoulder at 1 m.
constexpr double kHanging = kGravity * (3 * 0.8 + 2 * 0.45);
constexpr double kAllowed = 1e-3;

TEST(FreeSwing, EnergyOfAPendulumStays) {
  Limp limb(load_robot_model(kPendulum), {"shoulder"}, true);
  limb.set("shoulder", 1.2);
  double most = 0;
  EXPECT_LT(std::abs(energy_drift(limb, 10, kHanging, most)), kAllowed);
  EXPECT_LT(most, kAllowed);
}

TEST(FreeSwing, EnergyOfADoublePendulumStays) {
  for (const double angle : {0.3, 1.0, 2.0}) {  // gently, widely, and over the top
    Limp limb(load_robot_model(kPendulum), {"shoulder", "elbow"}, true);
    limb.set("shoulder", angle);
    limb.set("elbow", -0.7 * angle);
    double most = 0;
    EXPECT_LT(std::abs(energy_drift(limb, 10, kHanging, most)), kAllowed) << angle;
    EXPECT_LT(most, kAllowed) << angle;
  }
}

TEST(FreeSwing, EnergyOfTheRobotsArmStays) {
  const RobotModel robot = load_robot_model(WALKMAN_URDF_DIR "/walkman.urdf");
  const std::vector<std::string> arm = {"RShSag", "RShLat", "RShYaw", "RElbj"};
  Limp hanging(robot, arm, true);
  const double bottom = hanging.step().potential;  // near enough to the minimum for the size of the swing
  Limp limb(robot, arm, true);
  limb.set("RShSag", 1);
  limb.set("RElbj", -1);
  double most = 0;
  EXPECT_LT(std::abs(energy_drift(limb, 10, bottom, most)), kAllowed);
  EXPECT_LT(most, kAllowed);
}

TEST(FreeFlight, MomentumOfTheLimpRobotStays) {
  const RobotModel robot = load_robot_model(WALKMAN_URDF_DIR "/walkman.urdf");
  std::vector<std::string> free;
  for (const Joint& joint : robot.joints) {
    const bool finger = joint.mimic || joint.name.find("handj") != std::string::npos;
    if (!finger && joint.type == JointType::kRevolute) free.push_back(joint.name);
  }
  EXPECT_GT(free.size(), 25U);
  Limp body(robot, free, false);
  for (std::size_t k = 0; k < free.size(); ++k) {
    const auto i = static_cast<double>(k);
    body.set(free[k], 0.1 * std::sin(i), 1.5 * std::cos(1.7 * i));
  }
  body.body().bullet().setBaseOmega(btVector3(0.5, 0.3, -0.8));
  body.body().bullet().setBaseVel(btVector3(0.1, 0.2, 4));
  const tests::Mechanics first = body.step();
  EXPECT_GT(first.spin.norm(), 10);
  double slip = 0, twist = 0, energy = 0;
  for (int i = 1; i <= 1000; ++i) {
    const tests::Mechanics now = body.step();
    const Eigen::Vector3d fallen(0, 0, -now.mass * kGravity * i * kStep);
    slip = std::max(slip, (now.momentum - first.momentum - fallen).norm());
    twist = std::max(twist, (now.spin - first.spin).norm());
    energy = std::max(energy, std::abs(now.energy() - first.energy()));
  }
  EXPECT_LT(slip, 1e-5 * first.momentum.norm());
  EXPECT_LT(twist, 1e-5 * first.spin.norm());
  EXPECT_LT(energy, 1e-4 * first.kinetic);
}

}  // namespace
}  // namespace walkman::plant
