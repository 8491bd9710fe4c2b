// Events in the world: pushes, weights that move or are removed.

#include <cmath>

#include "tests/unit/plant/whole_plant.h"

namespace walkman::plant {
namespace {

class Events : public WholePlant {
 protected:
  [[nodiscard]] static double held_up_by_table(const Plant& plant) {
    double force = 0;
    for (const Contact& contact : plant.contacts()) {
      if (contact.body_a == "bar" || contact.body_b == "bar") force += contact.normal_force;
    }
    return force;
  }
};

TEST_F(Events, APushGivesItsImpulseToTheWholeRobot) {
  stand_alone(BaseKind::kFloating, 0.5);  // free flight
  scene_.events = {{0.02, "", PushEvent{"DWYTorso", {300, -40, 0}, {0, 0, 0.1}, 0.1}}};
  const auto momentum = [&](Plant& plant) {
    std::vector<Eigen::Vector3d> before;
    for (std::size_t i = 0; i < robot_.links.size(); ++i)
      before.push_back(plant.X_WL(static_cast<int>(i)) * robot_.links[i].p_LLcm);
    run(plant, 1);
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < robot_.links.size(); ++i)
      p += robot_.links[i].mass * (plant.X_WL(static_cast<int>(i)) * robot_.links[i].p_LLcm - before[i]) /
           Plant::kStep;
    return p;
  };
  const auto plant = build();
  run(*plant, 19);
  EXPECT_NEAR(momentum(*plant).head<2>().norm(), 0, 1e-3);  // step 19: not yet
  run(*plant, 100);
  const Eigen::Vector3d after = momentum(*plant);
  EXPECT_NEAR(after.x(), 30, 0.03);
  EXPECT_NEAR(after.y(), -4, 0.03);
}

TEST_F(Events, AWristSensorReadsAPushBeyondIt) {
  const auto calm = build();
  const Eigen::Vector3d force_W(3, -4, 5);
  const Eigen::Vector3d p_LP(0.02, 0.03, -0.2);
  scene_.events = {{0.5, "", PushEvent{"RSoftHandLink", force_W, p_LP, 2.0}}};
  const auto pushed = build();
  run(*calm, 500);
  run(*pushed, 500);
  EXPECT_EQ(calm->state_hash(), pushed->state_hash());
  run(*calm, 1);
  run(*pushed, 1);
  EXPECT_NE(calm->state_hash(), pushed->state_hash());
  // The arm reaches a new equilibrium, and the sensor reads the whole push.
  run(*calm, 1500);
  run(*pushed, 1500);
  const auto reading = [&](const Plant& plant) { return plant.F_So_S(0); };
  const Eigen::Isometry3d X_WS = pushed->X_WL(robot_.link_index("r_arm_ft"));
  const Eigen::Matrix3d R_SW = X_WS.linear().transpose();
  const Eigen::Vector3d p_WP = pushed->X_WL(robot_.link_index("RSoftHandLink")) * p_LP;
  const Eigen::Vector3d extra = reading(*pushed).force - reading(*calm).force;
  const Eigen::Vector3d extra_torque = reading(*pushed).torque - reading(*calm).torque;
  EXPECT_NEAR((extra - R_SW * force_W).norm(), 0, 0.3);
  EXPECT_NEAR((extra_torque - R_SW * (p_WP - X_WS.translation()).cross(force_W)).norm(), 0, 0.08);
  // The other wrist measures only the shaking.
  EXPECT_NEAR((pushed->F_So_S(1).force - calm->F_So_S(1).force).norm(), 0, 0.3);
}

TEST_F(Events, AWeightThatMovesTakesTheCentreOfMassAlong) {
  scene_.events = {{0.5, "", MoveWeightEvent{"bar", "left_weight", 0, scene_.objects[0].X_OX(0.40)}}};
  const auto plant = build();
  run(*plant, 500);
  const Eigen::Isometry3d before = plant->X_WO(0);
  EXPECT_NEAR(plant->object(0).p_OOcm().x() + 0.525, 0.520, 1e-3);
  run(*plant, 1);
  EXPECT_NEAR(plant->object(0).p_OOcm().x() + 0.525, 0.645, 0.0035);  // the paper's fourth
  EXPECT_NEAR((plant->X_WO(0).translation() - before.translation()).norm(), 0, 1e-4);
  run(*plant, 1000);
  EXPECT_NEAR(held_up_by_table(*plant), 1.2 * kGravity, 0.02 * 1.2 * kGravity);
  // The table supports it where its weights press: the table's force balances about the new centre of mass.
  double force = 0, moment = 0;
  for (const Contact& contact : plant->contacts()) {
    const double along = (plant->X_WO(0).inverse() * contact.p_WC).x();
    force += contact.normal_force;
    moment += along * contact.normal_force;
  }
  EXPECT_NEAR(moment / force, plant->object(0).p_OOcm().x(), 2e-3);
}

TEST_F(Events, AWeightThatIsTakenOffWeighsNothing) {
  scene_.events = {{0.5, "", RemoveWeightEvent{"bar", "right_weight"}}};
  const auto plant = build();
  run(*plant, 1500);
  EXPECT_EQ(plant->object(0).weights.size(), 1U);
  EXPECT_NEAR(held_up_by_table(*plant), 0.7 * kGravity, 0.02 * 0.7 * kGravity);
}

TEST_F(Events, AWeightWaitsForThePhaseItsEventNames) {
  scene_.events = {{0, "", RemoveWeightEvent{"bar", "right_weight"}, PhaseBegin{"lift", 2, 0.01}}};
  const auto plant = build();
  plant->begin_phase("lower");
  plant->begin_phase("lift");
  run(*plant, 100);
  EXPECT_EQ(plant->object(0).weights.size(), 2U);
  plant->begin_phase("lift");
  run(*plant, 10);
  EXPECT_EQ(plant->object(0).weights.size(), 2U);
  run(*plant, 1);
  EXPECT_EQ(plant->object(0).weights.size(), 1U);
  plant->begin_phase("lift");
  run(*plant, 100);
  EXPECT_EQ(plant->object(0).weights.size(), 1U);
}

TEST_F(Events, AWeightBesideTheAxisPullsTheCentreOfMassThere) {
  const Eigen::Isometry3d X_LA(Eigen::Translation3d(0.2, 0.05, -0.03));
  scene_.events = {{0.5, "", MoveWeightEvent{"bar", "left_weight", 0, X_LA}}};
  const auto plant = build();
  const Eigen::Vector3d before = plant->object(0).p_OOcm();
  run(*plant, 501);
  const Eigen::Vector3d moved = X_LA.translation() - Eigen::Vector3d(0.10 - 0.525, 0, 0);
  EXPECT_NEAR((plant->object(0).p_OOcm() - before - 0.5 / 1.2 * moved).norm(), 0, 1e-9);
}

TEST_F(Events, AMovingObjectGoesOnAsItMoved) {
  scene_.fixed.clear();
  scene_.events = {{0.1, "", MoveWeightEvent{"bar", "left_weight", 0, scene_.objects[0].X_OX(0.40)}}};
  const auto plant = build();
  run(*plant, 100);
  const double before = plant->X_WO(0).translation().z();
  run(*plant, 1);
  const double after = plant->X_WO(0).translation().z();
  EXPECT_NEAR((after - before) / Plant::kStep, -kGravity * 0.101, 1e-9);  // it keeps falling
}

TEST_F(Events, APushOnALinkThatIsNotThereIsRefused) {
  scene_.events = {{0, "experiment_1.yaml:31", PushEvent{"RSoftHandLnk", {1, 0, 0}, {0, 0, 0}, 0.1}}};
  try {
    (void)build();
    FAIL() << "accepted";
  } catch (const std::runtime_error& e) {
    const std::string message = e.what();
    EXPECT_NE(message.find("experiment_1.yaml:31: events push.link"), std::string::npos) << message;
    EXPECT_NE(message.find("did you mean \"RSoftHandLink\""), std::string::npos) << message;
  }
}

}  // namespace
}  // namespace walkman::plant
