// Torques of an arm compared with the change of potential energy and with virtual work in the same posture.

#include "adaptation/wrench/arm_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "urdf/reader/robot_model.h"

namespace walkman::wrench {
namespace {

using testing::HasSubstr;

constexpr double kCycle = 0.005;  // s
constexpr double kGravity = 9.81;

class ArmCheckTest : public testing::Test {
 protected:
  ArmCheckTest() { kinematics.update(q); }
  void SetUp() override {
    ASSERT_EQ(after(1, own_weight(), reading(zero, zero)), std::nullopt);
    check.take_zero();
  }

  [[nodiscard]] static std::vector<std::string> joints() {
    return {"RShSag", "RShLat", "RShYaw", "RElbj", "RForearmPlate", "RWrj1", "RWrj2"};
  }
  /// Torques that hold a system with the potential energy `energy` (J) at rest, by central differences.
  template <typename Energy>
  [[nodiscard]] Eigen::VectorXd held(const Energy& energy) {
    constexpr double kStep = 1e-5;
    Eigen::VectorXd tau(q.size());
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      Eigen::VectorXd moved = q;
      moved[i] += kStep;
      kinematics.update(moved);
      tau[i] = energy();
      moved[i] -= 2 * kStep;
      kinematics.update(moved);
      tau[i] = (tau[i] - energy()) / (2 * kStep);
    }
    kinematics.update(q);
    return tau;
  }
  [[nodiscard]] Eigen::VectorXd own_weight() {
    return held([&] { return kinematics.total_mass() * kGravity * kinematics.com().z(); });
  }
  /// Torques that hold against a force f_W on a point of a link.
  [[nodiscard]] Eigen::VectorXd against(const std::string& link, const Eigen::Vector3d& p_LP,
                                        const Eigen::Vector3d& f_W) {
    const int index = model.link_index(link);
    return held([&] { return -f_W.dot(kinematics.X_WL(index) * p_LP); });
  }
  /// Reading of the wrist's sensor for the hand and a force f_W on a point of it.
  [[nodiscard]] Wrench reading(const Eigen::Vector3d& p_SP, const Eigen::Vector3d& f_W) const {
    Wrench F = HandWeight(model, "r_arm_ft").F_So_S(kinematics);
    const Eigen::Vector3d f_S = kinematics.X_WL(model.link_index("r_arm_ft")).linear().transpose() * f_W;
    F.force += f_S;
    F.torque += p_SP.cross(f_S);
    return F;
  }
  std::optional<std::string> after(double seconds, const Eigen::VectorXd& torques, const Wrench& F_So_S) {
    for (int i = 0; i < static_cast<int>(seconds / kCycle); ++i)
      check.take(kinematics, torques, F_So_S, kCycle);
    return check.touch();
  }

  RobotModel model = load_robot_model(std::string(WALKMAN_URDF_DIR) + "/walkman.urdf");
  motion::KinematicTree kinematics{model, joints()};
  Eigen::VectorXd q{{-1.1, -0.4, 0.2, -0.4, 0.4, 0.2, -0.3}};
  ArmCheck check{model, "r_arm_ft", joints(), joints()};
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
};

TEST_F(ArmCheckTest, AnArmCarriesItselfAndWhatTheSensorReads) {
  const Eigen::Vector3d load(4, -7, -60);
  const Eigen::Vector3d p_SP(0.02, -0.1, -0.2);
  const Eigen::VectorXd carried = own_weight() + against("r_arm_ft", p_SP, load);
  EXPECT_GT((carried - own_weight()).cwiseAbs().maxCoeff(), 3 * ArmCheck::kTolerance);
  EXPECT_EQ(after(2, carried, reading(p_SP, load)), std::nullopt);
}

TEST_F(ArmCheckTest, WhatTouchesTheForearmIsNotTheSensors) {
  const Eigen::VectorXd push = against("RForearm", zero, {0, 0, -1});
  Eigen::Index worst = 0;
  const double most = push.cwiseAbs().maxCoeff(&worst);
  const auto pushed = [&](double torque) {
    check.restart();
    return after(2, own_weight() + torque / most * push, reading(zero, zero));
  };
  EXPECT_EQ(pushed(ArmCheck::kTolerance - 0.1), std::nullopt);
  EXPECT_EQ(pushed(-ArmCheck::kTolerance + 0.1), std::nullopt);
  const auto found = pushed(ArmCheck::kTolerance + 0.1);
  ASSERT_TRUE(found);
  EXPECT_THAT(*found, HasSubstr("joint " + joints()[static_cast<std::size_t>(worst)] + ":"));
  EXPECT_THAT(*found, HasSubstr("touches the arm"));
  EXPECT_TRUE(pushed(-ArmCheck::kTolerance - 0.1));
}

TEST_F(ArmCheckTest, ASpringOfAnotherConstantIsNoTouch) {
  const Eigen::Vector3d load(0, 0, -150);
  const Eigen::VectorXd carried = own_weight() + against("r_arm_ft", zero, load);
  ASSERT_GT(0.12 * (carried - own_weight()).cwiseAbs().maxCoeff(), ArmCheck::kTolerance / 2);
  check.restart();
  after(2, 1.12 * own_weight(), reading(zero, zero));
  check.take_zero();
  EXPECT_EQ(after(2, 1.12 * carried, reading(zero, load)), std::nullopt);
}

TEST_F(ArmCheckTest, ASensorThatHidesTheLoadIsOff) {
  const Eigen::Vector3d load(0, 0, -60);
  EXPECT_TRUE(after(2, own_weight() + against("r_arm_ft", zero, load), reading(zero, zero)));
}

TEST_F(ArmCheckTest, WhatIsThereAtRestIsTheZero) {
  Eigen::VectorXd torques = own_weight();
  torques[3] += 2 * ArmCheck::kTolerance;
  EXPECT_TRUE(after(2, torques, reading(zero, zero)));
  check.take_zero();
  EXPECT_EQ(check.touch(), std::nullopt);
  EXPECT_TRUE(after(2, own_weight(), reading(zero, zero)));
}

TEST_F(ArmCheckTest, ATouchIsToldAgainWhenItGrows) {
  const Eigen::VectorXd push = against("RForearm", zero, {0, 0, -50});
  EXPECT_TRUE(after(2, own_weight() + push, reading(zero, zero)));
  check.accept();
  EXPECT_EQ(after(2, own_weight() + push, reading(zero, zero)), std::nullopt);
  EXPECT_EQ(after(2, own_weight(), reading(zero, zero)), std::nullopt);
  EXPECT_TRUE(after(2, own_weight() + 2 * push, reading(zero, zero)));
}

TEST_F(ArmCheckTest, ABlowIsNoTouchAndOneReadingNoMean) {
  const Eigen::VectorXd blow = against("RForearm", zero, {0, 0, -200});
  check.restart();
  EXPECT_EQ(after(0.45, own_weight() + blow, reading(zero, zero)), std::nullopt);
  EXPECT_TRUE(after(0.1, own_weight() + blow, reading(zero, zero)));
  check.restart();
  EXPECT_EQ(after(2, own_weight(), reading(zero, zero)), std::nullopt);
  EXPECT_EQ(after(0.03, own_weight() + 0.2 * blow, reading(zero, zero)), std::nullopt);
}

TEST_F(ArmCheckTest, SaysNothingWithoutAZero) {
  ArmCheck other{model, "r_arm_ft", joints(), joints()};
  const Eigen::VectorXd torques = own_weight() + against("RForearm", zero, {0, 0, -200});
  for (int i = 0; i < 400; ++i) other.take(kinematics, torques, reading(zero, zero), kCycle);
  EXPECT_EQ(other.touch(), std::nullopt);
}

}  // namespace
}  // namespace walkman::wrench
