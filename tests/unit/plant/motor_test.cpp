// Every actuator class of the robot compared with the analytic model of its motor.

#include <cmath>

#include <gtest/gtest.h>

#include "emulator/plant/actuators/series_elastic_actuator.h"

namespace walkman::plant {
namespace {

constexpr double kMotorStep = 2.5e-4;

class EveryClass : public ::testing::TestWithParam<const char*> {
 protected:
  ActuatorParameters p_ =
      load_actuators(std::string(WALKMAN_URDF_DIR) + "/../emulator/plant/actuators").at(GetParam());

  /// Torque lost to sliding friction at `speed`.
  [[nodiscard]] double friction(double speed) const {
    return p_.coulomb_friction + p_.viscous_friction * speed;
  }
};

TEST_P(EveryClass, StallsAtThePeakTorqueAndTheWindingGivesNoMore) {
  Motor motor(p_);
  motor.advance(10 * p_.peak_torque, 1e6, false, 0);
  EXPECT_NEAR(motor.torque(),
              std::min(p_.peak_torque, p_.torque_constant * p_.supply_voltage / p_.winding_resistance), 1e-9);
  EXPECT_NEAR(motor.current() * p_.torque_constant, motor.torque(), 1e-9);
}

TEST_P(EveryClass, NoLoadSpeedIsWhereBackEmfAndFrictionLeaveNoCurrent) {
  p_.peak_time = 1e9;  // the power stage is not derated
  Motor motor(p_);
  for (int i = 0; i < 400'000; ++i) motor.advance(p_.peak_torque, 0, false, kMotorStep);
  // k (U - k w) / R = coulomb + viscous w
  const double k = p_.torque_constant;
  const double w = (k * p_.supply_voltage / p_.winding_resistance - p_.coulomb_friction) /
                   (k * k / p_.winding_resistance + p_.viscous_friction);
  EXPECT_NEAR(motor.velocity(), w, 1e-6 * w);
  EXPECT_LT(motor.velocity(), p_.supply_voltage / k);
}

TEST_P(EveryClass, TorqueSpeedCurveIsFlatThenFallsAlongTheVoltageLimit) {
  p_.viscous_friction = p_.coulomb_friction = p_.static_friction = 0;
  p_.peak_time = 1e9;
  Motor motor(p_);
  const double k = p_.torque_constant;
  while (motor.velocity() < 0.95 * p_.supply_voltage / k) {
    const double speed = motor.velocity();
    motor.advance(10 * p_.peak_torque, 0, false, kMotorStep);
    const double by_voltage = k * (p_.supply_voltage - k * speed) / p_.winding_resistance;
    ASSERT_NEAR(motor.torque(), std::min(p_.peak_torque, by_voltage), 1e-9) << speed;
  }
}

TEST_P(EveryClass, StepOfTorqueMovesTheInertia) {
  p_.viscous_friction = p_.coulomb_friction = p_.static_friction = 0;
  Motor motor(p_);
  const double torque = 0.2 * p_.continuous_torque;
  const double duration = 0.02;
  for (int i = 0; i < 80; ++i) motor.advance(torque, 0, false, kMotorStep);
  EXPECT_NEAR(motor.velocity(), torque / p_.motor_inertia * duration, 1e-9);
  // Semi-implicit steps are half a step ahead of t²/2.
  EXPECT_NEAR(motor.position(), torque / p_.motor_inertia * duration * (duration + kMotorStep) / 2, 1e-9);
}

TEST_P(EveryClass, StribeckFrictionHoldsUntilBreakAwayThenSlides) {
  Motor motor(p_);
  const double between = (p_.static_friction + p_.coulomb_friction) / 2;
  for (int i = 0; i < 4000; ++i) motor.advance(between, 0, false, kMotorStep);
  EXPECT_EQ(motor.position(), 0);
  for (int i = 0; i < 400; ++i) motor.advance(1.5 * p_.static_friction, 0, false, kMotorStep);
  EXPECT_GT(motor.velocity(), 0);
  // Once it slides, a torque below break-away keeps it going, at the speed that viscous friction allows.
  for (int i = 0; i < 400'000; ++i) motor.advance(between, 0, false, kMotorStep);
  const double speed = (between - p_.coulomb_friction) / p_.viscous_friction;
  const double stribeck = speed / p_.stribeck_speed;
  EXPECT_LE(motor.velocity(), speed);
  if (stribeck > 3) {
    EXPECT_NEAR(motor.velocity(), speed, 1e-3 * speed);
  }
}

TEST_P(EveryClass, SpringTracksATorqueThroughTheMotor) {
  // Link held: the spring settles at the motor's torque, up to the friction.
  p_.backlash = 0;
  SeriesElasticActuator actuator(p_);
  actuator.reset(0, 0);
  const double wanted = 0.3 * p_.continuous_torque;
  double torque = 0;
  const double damping = 1.4 * std::sqrt(p_.motor_inertia * p_.spring_constant);
  for (int i = 0; i < 20'000; ++i) {
    torque = actuator.advance(0, 0, wanted - damping * actuator.readings().motor_velocity, false, kMotorStep);
  }
  EXPECT_NEAR(torque, wanted, p_.static_friction);
}

TEST_P(EveryClass, WindingAndCaseWarmWithTheirTimeConstants) {
  Motor motor(p_);
  const double torque = 0.5 * p_.continuous_torque;
  const double current = torque / p_.torque_constant;
  const double loss = p_.winding_resistance * current * current;
  // Two first-order nodes: dw = (P - (w - c)/Rw)/Cw, dc = ((w - c)/Rw - c/Rc)/Cc, about the ambient.
  const double a = -1 / (p_.winding_thermal_resistance * p_.winding_heat_capacity);
  const double b = -a;
  const double c = 1 / (p_.winding_thermal_resistance * p_.case_heat_capacity);
  const double d = -c - 1 / (p_.case_thermal_resistance * p_.case_heat_capacity);
  const double mean = (a + d) / 2;
  const double root = std::sqrt(mean * mean - (a * d - b * c));
  const double fast = mean - root;
  const double slow = mean + root;
  const double w_end = loss * (p_.winding_thermal_resistance + p_.case_thermal_resistance);
  // w(t) = w_end + A e^(fast t) + B e^(slow t), with w(0) = 0 and w'(0) = P/Cw.
  const double slope = loss / p_.winding_heat_capacity;
  const double A = (slope + slow * w_end) / (fast - slow);
  const double B = -w_end - A;

  constexpr double kThermalStep = 1e-2;
  const double t_end = -2 / slow;
  double t = 0;
  while (t < t_end) {
    motor.advance(torque, torque, false, kThermalStep);
    t += kThermalStep;
    const double expected = w_end + A * std::exp(fast * t) + B * std::exp(slow * t);
    ASSERT_NEAR(motor.winding_temperature_c() - kAmbient, expected, 0.002 * w_end) << "at " << t << " s";
  }
  EXPECT_NEAR(motor.case_temperature_c() - kAmbient, loss * p_.case_thermal_resistance * (1 - std::exp(-2)),
              0.05 * loss * p_.case_thermal_resistance);
}

class ClassWithOverload : public EveryClass {};

TEST_P(ClassWithOverload, PeakTorqueLastsThePeakTimeThenDeratesToTheContinuousOne) {
  ASSERT_LT(p_.continuous_torque, p_.peak_torque);
  Motor motor(p_);
  double t = 0;
  while (motor.torque() >= 0 && t < 0.79 * p_.peak_time) {
    motor.advance(10 * p_.peak_torque, 10 * p_.peak_torque, true, 0);
    motor.advance(p_.peak_torque, p_.peak_torque, false, kMotorStep);
    t += kMotorStep;
    ASSERT_DOUBLE_EQ(motor.torque(), p_.peak_torque) << t;
  }
  for (; t < 20 * p_.peak_time; t += kMotorStep)
    motor.advance(p_.peak_torque, p_.peak_torque, false, kMotorStep);
  EXPECT_NEAR(motor.torque(), p_.continuous_torque, 0.01 * p_.continuous_torque);
  EXPECT_GT(motor.overload(), 0.99);
  // At rest, the allowance recovers at the rate of the continuous current's square.
  for (int i = 0; i < 4'000'000 && motor.overload() > 0; ++i) motor.advance(0, 0, false, kMotorStep);
  EXPECT_EQ(motor.overload(), 0);
  EXPECT_DOUBLE_EQ(motor.available_torque(1), p_.peak_torque);
}

class ClassWithoutOverload : public EveryClass {};

TEST_P(ClassWithoutOverload, PeakTorqueLastsForGood) {
  ASSERT_EQ(p_.continuous_torque, p_.peak_torque);
  Motor motor(p_);
  for (double t = 0; t < 60; t += kMotorStep) {
    motor.advance(p_.peak_torque, p_.peak_torque, false, kMotorStep);
    ASSERT_DOUBLE_EQ(motor.torque(), p_.peak_torque) << t;
  }
  EXPECT_EQ(motor.overload(), 0);
}

TEST_P(EveryClass, WithoutSupplyThereIsNoTorque) {
  Motor motor(p_);
  motor.set_supply_voltage(0);
  motor.advance(p_.peak_torque, 0, false, kMotorStep);
  EXPECT_EQ(motor.torque(), 0);
}

std::string class_name(const ::testing::TestParamInfo<const char*>& instance) { return instance.param; }

INSTANTIATE_TEST_SUITE_P(Actuators, EveryClass,
                         ::testing::Values("big", "medium", "medium2", "small", "hand"), class_name);
INSTANTIATE_TEST_SUITE_P(Actuators, ClassWithOverload, ::testing::Values("big", "medium", "medium2", "small"),
                         class_name);
INSTANTIATE_TEST_SUITE_P(Actuators, ClassWithoutOverload, ::testing::Values("hand"), class_name);

}  // namespace
}  // namespace walkman::plant
