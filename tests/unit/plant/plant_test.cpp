// The whole plant of the first experiment.

#include "emulator/plant/plant.h"

#include <gtest/gtest.h>

namespace walkman::plant {
namespace {

class WholePlant : public ::testing::Test {
 protected:
  static constexpr double kGravity = Plant::kGravity;
  const std::string urdf_ = WALKMAN_URDF_DIR;
  Scene scene_ = load_scene(urdf_ + "/scenes/experiment_1.yaml");
  RobotModel robot_ = load_robot_model(scene_.robot_urdf);
  DeviceTable devices_ = load_device_table(scene_.device_table, robot_);
  std::map<std::string, ActuatorParameters> actuators_ =
      load_actuators(urdf_ + "/../emulator/plant/actuators");

  [[nodiscard]] std::unique_ptr<Plant> build() const {
    return std::make_unique<Plant>(robot_, scene_, devices_, actuators_);
  }
  /// Steps with every brake closed but that of drive `free`, whose motor gets `torque`.
  static void run(Plant& plant, int steps, int free = -1, double torque = 0) {
    for (int i = 0; i < steps; ++i) {
      for (int s = 0; s < Plant::kSubSteps; ++s) {
        for (int d = 0; d < plant.drive_count(); ++d)
          plant.advance_drive(d, d == free ? torque : 0, d != free);
      }
      plant.step();
    }
  }
  [[nodiscard]] int drive(const std::string& name) const {
    int index = 0;
    for (const Bus& bus : devices_.buses) {
      for (const Device& device : bus.devices) {
        if (device.kind == DeviceKind::kForceTorque) continue;
        if (device.name == name) return index;
        ++index;
      }
    }
    return -1;
  }
};

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
  EXPECT_EQ(plant->solver_fallbacks(), 0);
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

TEST_F(WholePlant, TendonPullsWithTheMotorsTorqueOverThePulleysRadius) {
  const auto plant = build();
  run(*plant, 8000, drive("r_handj_synergy"), 1.0);        // closes on itself and stalls
  EXPECT_NEAR(plant->tendon_tension(0), 1.0 / 0.04, 0.6);  // within the motor's Coulomb friction, 0.02 N·m
  EXPECT_NEAR(plant->tendon_tension(1), 0, 1e-9);
}

}  // namespace
}  // namespace walkman::plant
