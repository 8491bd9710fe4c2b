// The rope of a hoisted robot.

#include "tests/unit/plant/whole_plant.h"

namespace walkman::plant {
namespace {

class Hoisted : public WholePlant {
 protected:
  Hoisted() { stand_alone(BaseKind::kHoisted); }
  /// Runs a step without power on any drive.
  static void hang(Plant& plant) {
    std::map<int, double> limp;
    for (int d = 0; d < plant.drive_count(); ++d) limp[d] = 0;
    step(plant, limp);
  }
};

TEST_F(Hoisted, ARopeCarriesTheRobotThatHasNoPower) {
  stand_alone(BaseKind::kHoisted, 0.50);  // off the floor: only the rope holds it
  scene_.rope.length = 1.5;               // taut from the start, by default 1.5 m below its anchor
  const auto plant = build();
  double mean = 0;
  for (int i = 0; i < 3000; ++i) hang(*plant);
  for (int i = 0; i < 3000; ++i) {
    hang(*plant);
    mean += plant->hoist_tension() / 3000;
    ASSERT_GE(plant->hoist_tension(), 0);
  }
  for (const Contact& contact : plant->contacts()) {
    EXPECT_NE(contact.body_a, "room");
    EXPECT_NE(contact.body_b, "room");
  }
  const double weight = robot_.total_mass() * kGravity;
  EXPECT_NEAR(weight, 118 * kGravity, 5);
  EXPECT_NEAR(mean, weight, 0.02 * weight);  // it still swings
}

TEST_F(Hoisted, ASlackRopePullsNothing) {
  const auto plant = build();
  for (int i = 0; i < 500; ++i) {
    run(*plant, 1);  // brakes closed: it stands
    ASSERT_EQ(plant->hoist_tension(), 0);
  }
}

TEST_F(Hoisted, RobotWithoutPowerSinksUntilTheRopeHoldsIt) {
  const auto plant = build();
  const int chest = robot_.link_index(scene_.rope.link);
  const double before = (plant->X_WL(chest) * scene_.rope.p_LE).z();
  double lowest = before;
  for (int i = 0; i < 3000; ++i) {
    hang(*plant);
    lowest = std::min(lowest, (plant->X_WL(chest) * scene_.rope.p_LE).z());
  }
  EXPECT_GT(plant->hoist_tension(), 0.3 * robot_.total_mass() * kGravity);
  EXPECT_GT(before - lowest, 0.04);
  EXPECT_LT(before - lowest, 0.05 + 0.04);  // the slack, and the rope's stretch when it catches the fall
}

TEST_F(Hoisted, ARopeOnALinkThatIsNotThereIsRefused) {
  scene_.rope.link = "DWYTorsoo";
  scene_.rope.where = "experiment_1.yaml:12";
  try {
    (void)build();
    FAIL() << "accepted";
  } catch (const std::runtime_error& e) {
    const std::string message = e.what();
    EXPECT_NE(message.find("experiment_1.yaml:12: robot.base.rope.link"), std::string::npos) << message;
    EXPECT_NE(message.find("did you mean \"DWYTorso\""), std::string::npos) << message;
  }
}

}  // namespace
}  // namespace walkman::plant
