// The whole plant of the first experiment.

#include <gmock/gmock.h>

#include "tests/unit/plant/whole_plant.h"

namespace walkman::plant {
namespace {

TEST_F(WholePlant, TableCarriesTheBarAndNothingElseDoes) {
  const auto plant = build();
  run(*plant, 500);
  double table = 0;
  for (const Contact& contact : plant->contacts()) {
    const bool bar = contact.body_a == "bar" || contact.body_b == "bar";
    const bool on_table = contact.body_a == "table" || contact.body_b == "table";
    EXPECT_TRUE(bar && on_table) << contact.body_a << " touches " << contact.body_b;
    table += contact.normal_force;
  }
  EXPECT_NEAR(table, 1.2 * kGravity, 0.005 * 1.2 * kGravity);
  EXPECT_TRUE(plant->object_touches_fixed(0));
}

// Bullet would eject it at several metres per second.
TEST_F(WholePlant, NothingStartsInsideSomethingElse) {
  scene_.objects[0].X_WO.translation().z() -= 0.012;
  try {
    static_cast<void>(build());
    FAIL() << "built";
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(),
                testing::AllOf(testing::HasSubstr("experiment_1.yaml: "), testing::HasSubstr("bar"),
                               testing::HasSubstr("starts 12.0 mm inside"), testing::HasSubstr("table")));
  }
  scene_.objects[0].X_WO.translation().z() += 0.0105;  // 1.5 mm can come from a mesh or a measurement
  EXPECT_NO_THROW(static_cast<void>(build()));
}

TEST_F(WholePlant, SameBuildGivesTheSameStateToTheLastBit) {
  const auto a = build();
  const auto b = build();
  for (int i = 0; i < 30; ++i) {
    run(*a, 10, drive("RElbj"), 5);
    run(*b, 10, drive("RElbj"), 5);
    ASSERT_EQ(a->state_hash(), b->state_hash()) << "after " << 10 * (i + 1) << " steps";
  }
  run(*b, 1, drive("RElbj"), 5);
  EXPECT_NE(a->state_hash(), b->state_hash());
}

TEST_F(WholePlant, ArmsAtRestWeighTheirHands) {
  const auto plant = build();
  run(*plant, 6000);  // the springs' ringing has died away
  for (const int wrist : {0, 1}) {
    EXPECT_NEAR(plant->F_So_S(wrist).force.norm(), 1.2 * kGravity, 0.02 * 1.2 * kGravity);
  }
}

TEST_F(WholePlant, TheInertialUnitOfAPelvisThatStandsStillFeelsGravity) {
  const auto plant = build();
  run(*plant, 20, drive("RElbj"), 5);
  const InertialMotion& motion = plant->inertial_motion(0);
  // The scene's pelvis is upright; the unit is aligned with its axes.
  EXPECT_NEAR((motion.specific_force_S - Eigen::Vector3d(0, 0, kGravity)).norm(), 0, 1e-9);
  EXPECT_NEAR(motion.angular_velocity_S.norm(), 0, 1e-12);
  const Eigen::Matrix3d R_WS = plant->X_WL(robot_.link_index("imu_link")).linear();
  EXPECT_NEAR((motion.q_WS.toRotationMatrix() - R_WS).norm(), 0, 1e-12);
}

TEST_F(WholePlant, AnInertialUnitOnAMovingHandFeelsWhatItsPathSays) {
  Device unit;
  unit.kind = DeviceKind::kInertialUnit;
  unit.node_id = 92;
  unit.name = "RSoftHandLink";
  devices_.buses[1].devices.push_back(unit);
  const auto plant = build();
  const int link = robot_.link_index("RSoftHandLink");
  run(*plant, 40, drive("RElbj"), 30);
  std::vector<Eigen::Isometry3d> path;
  std::vector<InertialMotion> felt;
  for (int i = 0; i < 100; ++i) {
    path.push_back(plant->X_WL(link));  // a step's readings are those at its start
    run(*plant, 1, drive("RElbj"), 30);
    felt.push_back(plant->inertial_motion(1));
  }
  double fastest = 0, hardest = 0, worst_force = 0, worst_rate = 0;
  for (std::size_t i = 1; i + 1 < path.size(); ++i) {
    const double dt = Plant::kStep;
    const Eigen::Matrix3d R_SW = path[i].linear().transpose();
    const Eigen::Vector3d acceleration =
        (path[i + 1].translation() - 2 * path[i].translation() + path[i - 1].translation()) / (dt * dt);
    const Eigen::Vector3d force = R_SW * (acceleration + Eigen::Vector3d(0, 0, kGravity));
    const Eigen::AngleAxisd turned(Eigen::Matrix3d(path[i - 1].linear().transpose() * path[i].linear()));
    const Eigen::Vector3d rate = turned.angle() / dt * turned.axis();
    worst_force = std::max(worst_force, (felt[i].specific_force_S - force).norm());
    worst_rate = std::max(worst_rate, (felt[i].angular_velocity_S - rate).norm());
    fastest = std::max(fastest, rate.norm());
    hardest = std::max(hardest, acceleration.norm());
    EXPECT_NEAR((felt[i].q_WS.toRotationMatrix() - path[i].linear()).norm(), 0, 1e-12);
  }
  EXPECT_GT(fastest, 2);   // rad/s
  EXPECT_GT(hardest, 10);  // m/s^2
  // First order in the step size.
  EXPECT_LT(worst_force, 0.01 * hardest);
  EXPECT_LT(worst_rate, 0.001 * fastest);
}

TEST_F(WholePlant, ABarOnTheTableIsHeldByNoHand) {
  const auto plant = build();
  run(*plant, 1500, drive("r_handj_synergy"), 2.0);
  for (const int hand : {0, 1}) {
    EXPECT_FALSE(plant->slip(hand, 0).held);
    EXPECT_EQ(plant->slip(hand, 0).travel, 0);
    EXPECT_EQ(plant->slip(hand, 0).turn, 0);
  }
}

TEST_F(WholePlant, TendonPullsWithTheMotorsTorqueOverThePulleysRadius) {
  const auto plant = build();
  run(*plant, 8000, drive("r_handj_synergy"), 1.0);        // closes on itself and stalls
  EXPECT_NEAR(plant->tendon_tension(0), 1.0 / 0.04, 0.7);  // within the motor's static friction, 0.026 N·m
  EXPECT_NEAR(plant->tendon_tension(1), 0, 0.5);           // no more than the weight of its fingers
}

}  // namespace
}  // namespace walkman::plant
