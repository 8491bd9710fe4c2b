#include "adaptation/motion/body_guard.h"

#include <random>

#include <gmock/gmock.h>

#include "tests/unit/motion/reference_robot.h"

namespace walkman::motion {
namespace {

class BodyGuardTest : public testing::Test {
 protected:
  BodyGuardTest() : robot(reference_robot()), kinematics(robot.model, robot.joint_names) {
    kinematics.set_base(robot.X_WB);
    kinematics.update(robot.q_home);
  }
  [[nodiscard]] BodyGuard guard_of(const HandMotionOptions& options) const {
    std::vector<int> moving;
    for (const std::string& joint : options.active_joints) moving.push_back(kinematics.dof_of(joint));
    const int shoulder = robot.model.link_index(options.hand_link[0] == 'r' ? "RShp" : "LShp");
    return {kinematics, moving, false, shoulder, options.hand_link, "", options.disabled_collisions, {}};
  }

  const ReferenceRobot& robot;
  KinematicTree kinematics;
};

TEST_F(BodyGuardTest, NothingTouchesAtHomeNorAtWork) {
  BodyGuard guard = guard_of(robot.right);
  guard.update();
  EXPECT_GT(guard.own_clearance(), 0.005);
  Eigen::VectorXd q = robot.q_home;
  for (const auto& [joint, position] : robot.right.posture) q[kinematics.dof_of(joint)] = position;
  kinematics.update(q);
  guard.update();
  EXPECT_GT(guard.own_clearance(), 0.005);
}

// What it keeps from one posture must not hide anything in another.
TEST_F(BodyGuardTest, SeesTheSameWhereverItLookedBefore) {
  BodyGuard moved = guard_of(robot.right);
  std::mt19937 draws(1);
  for (int posture = 0; posture < 50; ++posture) {
    Eigen::VectorXd q = robot.q_home;
    for (const std::string& joint : robot.right.active_joints) {
      const int dof = kinematics.dof_of(joint);
      q[dof] =
          std::uniform_real_distribution(kinematics.limits(dof).lower, kinematics.limits(dof).upper)(draws);
    }
    kinematics.update(q);
    moved.update();
    BodyGuard fresh = guard_of(robot.right);
    fresh.update();
    EXPECT_EQ(moved.own_clearance(), fresh.own_clearance());
    ASSERT_EQ(moved.near().size(), fresh.near().size());
    for (std::size_t i = 0; i < fresh.near().size(); ++i)
      EXPECT_EQ(moved.near()[i].gap.distance, fresh.near()[i].gap.distance);
  }
}

// Tests both arms, the left one with mirrored postures.
TEST_F(BodyGuardTest, SeesTheHandComeToEveryPartOfTheBody) {
  BodyGuard right = guard_of(robot.right), left = guard_of(robot.left);
  struct Case {
    std::map<std::string, double> joints;  // of the right arm, names without the R
    std::string met;                       // as seen from the right arm
  };
  const std::vector<std::string> flipped = {"ShLat", "ShYaw", "ForearmPlate", "Wrj2"};
  // The arm hangs down: hip and thigh; it bends in front of the chest; the shoulder turns the arm to the
  // head.
  for (const Case& c :
       {Case{{{"ShSag", 0.3}, {"ShLat", -0.13}, {"ShYaw", 0}, {"Elbj", -0.25}}, "Thigh|Hip|Waist"},
        Case{{{"ShSag", 0.9}, {"ShLat", -0.2}, {"ShYaw", 1.2}, {"Elbj", -2.0}}, "Torso|DW|Elb|Forearm|Wr"},
        Case{{{"ShSag", -0.07}, {"ShLat", -0.68}, {"ShYaw", 1.27}, {"Elbj", -1.09}}, "head"}}) {
    for (const bool mirrored : {false, true}) {
      Eigen::VectorXd q = robot.q_home;
      for (const auto& [joint, position] : c.joints) {
        const bool flips = std::find(flipped.begin(), flipped.end(), joint) != flipped.end();
        q[kinematics.dof_of((mirrored ? "L" : "R") + joint)] = mirrored && flips ? -position : position;
      }
      kinematics.update(q);
      BodyGuard& guard = mirrored ? left : right;
      guard.update();
      std::string seen;
      for (const BodyGuard::Nearness& nearness : guard.near()) seen += guard.describe(nearness) + "; ";
      EXPECT_THAT(seen, testing::ContainsRegex(c.met)) << (mirrored ? "left" : "right");
    }
  }
}

TEST_F(BodyGuardTest, MeasuresTheDistanceToATableBySolidsCorners) {
  BodyGuard guard = guard_of(robot.right);
  // A floor below everything that moves: the expected distance is to the lowest corner of the boxes in the
  // URDF.
  const std::vector<Eigen::Vector3d> floor = {{-5, -5, 0.75}, {5, -5, 0.75}, {5, 5, 0.75}, {-5, 5, 0.75}};
  guard.set_obstacles({{"the floor", ConvexPrism(Eigen::Vector3d::UnitZ(), floor)}});
  Eigen::VectorXd q = robot.q_home;
  q[kinematics.dof_of("RElbj")] = -0.9;
  kinematics.update(q);
  guard.update();
  double lowest = 10;
  for (const char* name : {"RShy", "RElb", "RForearm", "RWrMot3", "RSoftHandLink"}) {
    const int link = robot.model.link_index(name);
    for (const LinkGeometry& geometry : robot.model.links[static_cast<std::size_t>(link)].collisions) {
      const auto* box = std::get_if<BoxShape>(&geometry.shape);
      ASSERT_NE(box, nullptr);
      for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3d sign(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, corner & 4 ? 0.5 : -0.5);
        const Eigen::Vector3d p = kinematics.X_WL(link) * (geometry.X_LG * sign.cwiseProduct(box->size));
        lowest = std::min(lowest, p.z());
      }
    }
  }
  ASSERT_LT(lowest - 0.75, BodyGuard::kFarthest);
  EXPECT_NEAR(guard.obstacle_clearance(), lowest - 0.75, 1e-9);
}

TEST_F(BodyGuardTest, FingersComeAsNearAsTheirGoalIsAndNoNearer) {
  BodyGuard guard = guard_of(robot.right);
  const GuardMargins margins;
  // A floor far below: the lowest point of the fingers follows from how far the floor must rise to be in
  // their way.
  const auto margin_over = [&](double height, double moved_down) {
    const std::vector<Eigen::Vector3d> floor = {
        {-5, -5, height}, {5, -5, height}, {5, 5, height}, {-5, 5, height}};
    guard.set_obstacles({{"the floor", ConvexPrism(Eigen::Vector3d::UnitZ(), floor)}});
    guard.update(true);
    return guard.finger_margin(Eigen::Isometry3d(Eigen::Translation3d(0, 0, -moved_down)));
  };
  EXPECT_DOUBLE_EQ(margin_over(0, 0), margins.arm);
  double lowest = 0;
  while (margin_over(lowest, 0) > 0) lowest += 1e-3;
  lowest -= 1e-3;
  const double room = margin_over(lowest, 0);
  EXPECT_NEAR(margin_over(lowest - 0.01, 0), room + 0.01, 1e-9);
  EXPECT_NEAR(margin_over(lowest - 0.01, 0.01), room, 1e-9);
  EXPECT_LT(margin_over(lowest, 0.01), 0);  // ends inside the floor
}

}  // namespace
}  // namespace walkman::motion
