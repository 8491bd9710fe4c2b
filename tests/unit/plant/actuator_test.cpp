// The series elastic actuator compared with the equations of motion of its parts.

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "emulator/plant/actuators/series_elastic_actuator.h"

namespace walkman::plant {
namespace {

constexpr double kStep = 2.5e-4;

ActuatorParameters plain() {
  ActuatorParameters p;
  p.motor_inertia = 0.3;
  p.spring_constant = 1300;
  p.spring_damping = 0;
  p.torque_constant = 6.84;
  p.winding_resistance = 1.22;
  p.supply_voltage = 1e9;
  p.peak_torque = 140;
  p.continuous_torque = 140;
  p.peak_time = 5;
  p.stribeck_speed = 0.05;
  p.winding_heat_capacity = 60;
  p.winding_thermal_resistance = 0.4;
  p.case_heat_capacity = 900;
  p.case_thermal_resistance = 0.8;
  return p;
}

TEST(SeriesElasticActuator, SwingsAtTheFrequencyOfMotorAndSpring) {
  SeriesElasticActuator actuator(plain());
  actuator.reset(0, 13);  // spring wound by 10 mrad, link held
  int crossings = 0;
  double previous = actuator.motor().position();
  const double seconds = 20;
  for (double t = 0; t < seconds; t += kStep) {
    actuator.advance(0, 0, 0, false, kStep);
    if (previous < 0 && actuator.motor().position() >= 0) ++crossings;
    previous = actuator.motor().position();
  }
  const double expected = std::sqrt(1300 / 0.3) / (2 * M_PI);
  EXPECT_NEAR(crossings / seconds, expected, 0.01 * expected);
}

TEST(SeriesElasticActuator, BrakeHoldsTheMotorWhileTheSpringStillBends) {
  SeriesElasticActuator actuator(plain());
  actuator.reset(0.2, 0);
  EXPECT_NEAR(actuator.advance(0.21, 0, 50, true, kStep), -13, 1e-9);
  EXPECT_DOUBLE_EQ(actuator.motor().position(), 0.2);
}

TEST(SeriesElasticActuator, GearErrorsComeTwicePerTurnOfTheMotor) {
  ActuatorParameters p = plain();
  p.gear_ratio = 100;
  const double amplitude = 1.5e-4;
  // Motor and link are held: the spring's deflection beyond the ratio is the gear's error.
  for (const double angle : {0.0, 0.001, 0.004, 0.0123, 0.2}) {
    SeriesElasticActuator actuator(p, {p.spring_constant, 0, 0}, {0.6 * amplitude, 0.8 * amplitude});
    actuator.reset(angle, 0);
    const double motor = actuator.motor().position();
    const double torque = actuator.advance(angle, 0, 0, true, kStep);
    EXPECT_NEAR(torque, 0, 1300 * amplitude * 0.04) << angle;  // starts at rest, except for the error's slope
    const double error = 0.6 * amplitude * std::sin(200 * motor) + 0.8 * amplitude * std::cos(200 * motor);
    EXPECT_NEAR(actuator.advance(motor, 0, 0, true, kStep), 1300 * error, 1e-9) << angle;
  }
}

TEST(SeriesElasticActuator, GearErrorsTakeNoEnergyAndGiveNone) {
  ActuatorParameters p = plain();
  p.gear_ratio = 100;
  const double sine = 1e-4, cosine = -5e-5;
  SeriesElasticActuator actuator(p, {p.spring_constant, 0, 0}, {sine, cosine});
  actuator.reset(0, 65);  // swings over ten periods of the error
  const auto energy = [&] {
    const double x = actuator.motor().position(), v = actuator.motor().velocity();
    const double bent = x + sine * std::sin(200 * x) + cosine * std::cos(200 * x);
    return 0.5 * 0.3 * v * v + 0.5 * 1300 * bent * bent;
  };
  const double before = energy();
  double least = before, most = before;
  for (int i = 0; i < 40'000; ++i) {
    actuator.advance(0, 0, 0, false, kStep / 10);
    least = std::min(least, energy());
    most = std::max(most, energy());
  }
  EXPECT_NEAR(least / before, 1, 0.01);
  EXPECT_NEAR(most / before, 1, 0.01);
}

TEST(SeriesElasticActuator, BacklashPassesNoTorqueInside) {
  ActuatorParameters p = plain();
  p.backlash = 2e-3;
  SeriesElasticActuator actuator(p);
  actuator.reset(0, 0);
  EXPECT_EQ(actuator.advance(0.9e-3, 0, 0, true, kStep), 0);
  EXPECT_EQ(actuator.advance(-0.9e-3, 0, 0, true, kStep), 0);
  EXPECT_NEAR(actuator.advance(3e-3, 0, 0, true, kStep), -1300 * 2e-3, 1e-9);
  EXPECT_NEAR(actuator.advance(-3e-3, 0, 0, true, kStep), 1300 * 2e-3, 1e-9);
}

TEST(SeriesElasticActuator, CoulombFrictionStopsButNeverReverses) {
  ActuatorParameters p = plain();
  p.spring_constant = 1e-9;
  p.coulomb_friction = 1.2;
  SeriesElasticActuator actuator(p);
  actuator.reset(0, 0);
  for (int i = 0; i < 1000; ++i) actuator.advance(0, 0, 1.1, false, kStep);
  EXPECT_EQ(actuator.motor().position(), 0);  // below the break-away torque
  actuator.advance(0, 0, 100, false, kStep);
  EXPECT_GT(actuator.motor().position(), 0);
  double previous = actuator.motor().position();
  for (int i = 0; i < 4000; ++i) {
    actuator.advance(0, 0, 0, false, kStep);
    EXPECT_GE(actuator.motor().position(), previous);
    previous = actuator.motor().position();
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
