// The series elastic actuator against the equations of motion of its parts.

#include <cmath>

#include <gtest/gtest.h>

#include "emulator/plant/series_elastic_actuator.h"

namespace walkman::plant {
namespace {

constexpr double kStep = 2.5e-4;

ActuatorParameters plain() {
  ActuatorParameters p;
  p.motor_inertia = 0.3;
  p.spring_constant = 1300;
  p.spring_damping = 0;
  p.peak_torque = 140;
  p.no_load_speed = 1e9;
  return p;
}

TEST(SeriesElasticActuator, SwingsAtTheFrequencyOfMotorAndSpring) {
  SeriesElasticActuator actuator(plain());
  actuator.reset(0, 13);  // spring wound by 10 mrad, link held
  int crossings = 0;
  double previous = actuator.motor_position();
  const double seconds = 20;
  for (double t = 0; t < seconds; t += kStep) {
    actuator.advance(0, 0, 0, false, kStep);
    if (previous < 0 && actuator.motor_position() >= 0) ++crossings;
    previous = actuator.motor_position();
  }
  const double expected = std::sqrt(1300 / 0.3) / (2 * M_PI);
  EXPECT_NEAR(crossings / seconds, expected, 0.01 * expected);
}

TEST(SeriesElasticActuator, BrakeHoldsTheMotorWhileTheSpringStillBends) {
  SeriesElasticActuator actuator(plain());
  actuator.reset(0.2, 0);
  EXPECT_NEAR(actuator.advance(0.21, 0, 50, true, kStep), -13, 1e-9);
  EXPECT_DOUBLE_EQ(actuator.motor_position(), 0.2);
}

TEST(SeriesElasticActuator, RunsAtNoLoadSpeedAndStallsAtPeakTorque) {
  ActuatorParameters p = plain();
  p.spring_constant = 1e-9;
  p.no_load_speed = 5.85;
  SeriesElasticActuator actuator(p);
  actuator.reset(0, 0);
  actuator.advance(0, 0, 1000, false, kStep);
  EXPECT_DOUBLE_EQ(actuator.motor_torque(), 140);  // stall: the current limit
  double before = 0;
  double speed = 0;
  for (int i = 0; i < 40000; ++i) {
    before = actuator.motor_position();
    actuator.advance(0, 0, 1000, false, kStep);
    speed = (actuator.motor_position() - before) / kStep;
  }
  EXPECT_NEAR(speed, 5.85, 1e-3);
}

TEST(SeriesElasticActuator, CoulombFrictionStopsButNeverReverses) {
  ActuatorParameters p = plain();
  p.spring_constant = 1e-9;
  p.coulomb_friction = 1.2;
  SeriesElasticActuator actuator(p);
  actuator.reset(0, 0);
  for (int i = 0; i < 1000; ++i) actuator.advance(0, 0, 1.1, false, kStep);
  EXPECT_EQ(actuator.motor_position(), 0);  // below break-away
  actuator.advance(0, 0, 100, false, kStep);
  EXPECT_GT(actuator.motor_position(), 0);
  double previous = actuator.motor_position();
  for (int i = 0; i < 4000; ++i) {
    actuator.advance(0, 0, 0, false, kStep);
    EXPECT_GE(actuator.motor_position(), previous);
    previous = actuator.motor_position();
  }
}

TEST(SeriesElasticActuator, EncodersReadOnTheirLattice) {
  ActuatorParameters p = plain();
  p.motor_encoder_step = 1e-3;
  p.link_encoder_step = 2e-3;
  SeriesElasticActuator actuator(p);
  actuator.reset(0.12345, 6.5);
  EXPECT_DOUBLE_EQ(actuator.readings().link_position, 62 * 2e-3);
  EXPECT_DOUBLE_EQ(actuator.readings().motor_position, 128 * 1e-3);
  EXPECT_NEAR(actuator.readings().spring_torque, 1300 * (0.128 - 0.124), 1e-9);
}

TEST(SeriesElasticActuator, TendonCannotPush) {
  SeriesElasticActuator actuator(plain(), Transmission::kTendon);
  actuator.reset(0, 0);
  EXPECT_EQ(actuator.advance(0.1, 0, 0, true, kStep), 0);
  EXPECT_EQ(actuator.readings().spring_torque, 0);
  EXPECT_DOUBLE_EQ(actuator.advance(-0.1, 0, 0, true, kStep), 130);
}

}  // namespace
}  // namespace walkman::plant
