#include "adaptation/motion/feet_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/motion/reference_robot.h"

namespace walkman::motion {
namespace {

using testing::HasSubstr;

constexpr double kCycle = 0.005;  // s

class FeetCheckTest : public testing::Test {
 protected:
  FeetCheckTest() : robot(reference_robot()), posed(robot.model, robot.joint_names), stance(robot.model) {
    posed.update(robot.q_home);
    stance.take(posed);
    posed.set_base(stance.X_TB(posed));
    posed.update(robot.q_home);
    check.emplace(posed, stance);
  }
  /// Returns the sensor readings for vertical forces (N) at points of the soles, in their frames, by the
  /// definition of a moment.
  [[nodiscard]] std::array<FootLoad, Stance::kFeet> loads(const std::array<double, 2>& force,
                                                          const std::array<Eigen::Vector2d, 2>& p_FP) const {
    std::array<FootLoad, Stance::kFeet> feet;
    for (std::size_t i = 0; i < feet.size(); ++i) {
      feet[i].sensor_link = robot.model.link_index(i == 0 ? "l_leg_ft" : "r_leg_ft");
      const Eigen::Isometry3d& X_TS = posed.X_WL(feet[i].sensor_link);
      const Eigen::Vector3d p_TP =
          posed.X_WL(stance.sole_link(static_cast<int>(i))) * Eigen::Vector3d(p_FP[i].x(), p_FP[i].y(), 0);
      const Eigen::Vector3d f_S = X_TS.linear().transpose() * Eigen::Vector3d(0, 0, force[i]);
      feet[i].F_So_S = {(X_TS.inverse() * p_TP).cross(f_S), f_S};
    }
    return feet;
  }
  std::optional<std::string> after(double seconds, const std::array<FootLoad, Stance::kFeet>& feet) {
    for (int i = 0; i < static_cast<int>(seconds / kCycle); ++i) check->take(posed, stance, feet, kCycle);
    return check->contradiction(posed);
  }
  /// Weight of everything but the feet, which are below the sensors: 3.426381 kg each by the URDF.
  [[nodiscard]] double weight() const { return (posed.total_mass() - 2 * 3.426381) * kGravity; }

  const ReferenceRobot& robot;
  KinematicTree posed;
  Stance stance;
  std::optional<FeetCheck> check;
  const std::array<Eigen::Vector2d, 2> middle{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
};

TEST_F(FeetCheckTest, BelievesAWeightWithALoadAndASwayOfIt) {
  EXPECT_EQ(after(3, loads({weight() / 2, weight() / 2}, middle)), std::nullopt);
  EXPECT_EQ(after(3, loads({weight() / 2 + 80, weight() / 2}, middle)), std::nullopt);  // 8 kg in the hand
  EXPECT_EQ(after(0.05, loads({weight() / 2 + 500, weight() / 2}, middle)), std::nullopt);
}

TEST_F(FeetCheckTest, AWeightThatNobodyHasIsASensorsFault) {
  EXPECT_EQ(after(3, loads({weight() / 2, weight() / 2}, middle)), std::nullopt);
  const auto found = after(1, loads({-weight() / 2, weight() / 2}, middle));
  ASSERT_TRUE(found);
  EXPECT_THAT(*found, HasSubstr("sensors measure"));
  EXPECT_THAT(*found, HasSubstr("expected the weight above them"));
}

TEST_F(FeetCheckTest, TheGroundPushesNowhereBesideASole) {
  // The sole is 32 x 16 cm, its centre 5 mm in front of the frame and 10 mm to its left (the URDF's box).
  const auto at = [&](double x, double y) {
    return loads({weight() / 2, weight() / 2}, {Eigen::Vector2d(x, y), Eigen::Vector2d::Zero()});
  };
  EXPECT_EQ(after(3, at(0.165 + 0.018, 0)), std::nullopt);
  EXPECT_EQ(after(3, at(0, -0.07 - 0.018)), std::nullopt);
  const auto found = after(3, at(0.165 + 0.025, 0));
  ASSERT_TRUE(found);
  EXPECT_THAT(*found, HasSubstr("l_leg_ft"));
  EXPECT_TRUE(after(3, at(0, -0.07 - 0.025)));
  EXPECT_TRUE(after(3, at(-0.155 - 0.025, 0)));
  EXPECT_EQ(after(3, at(-0.155 - 0.015, 0.09 + 0.01)), std::nullopt);
}

TEST_F(FeetCheckTest, AFootInTheAirHasNoPlace) {
  EXPECT_EQ(after(3, loads({weight() - 50, 50}, {Eigen::Vector2d::Zero(), Eigen::Vector2d(0.5, 0)})),
            std::nullopt);
}

TEST_F(FeetCheckTest, SaysNothingBeforeItsMeanIsOne) {
  EXPECT_EQ(after(1.9, loads({0, 0}, middle)), std::nullopt);
  EXPECT_TRUE(after(0.2, loads({0, 0}, middle)));
  check->restart();
  EXPECT_EQ(after(1.9, loads({0, 0}, middle)), std::nullopt);
}

}  // namespace
}  // namespace walkman::motion
