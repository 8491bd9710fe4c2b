// The stabiliser in closed loop with a robot of two masses on elastic legs, one axis at a time: sampling, bus
// and drives add delay, the sensors are noisy and biased, and the model that it was designed for differs from
// the robot.

#include "adaptation/motion/stabiliser.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace walkman::motion {
namespace {

constexpr double kDt = 0.005;     // s, control cycle
constexpr double kStep = 2.5e-4;  // s, integration step
constexpr double kHeight = 0.98;  // m
constexpr double kMass = 118;     // kg, as assumed by the stabiliser
constexpr double kGravityRate = kGravity / kHeight;
/// Stiffness of a standing WALK-MAN about its ankles, from the sway of its springs, N·m/rad.
constexpr double kStiffness[2] = {8.0e3, 25.8e3};

struct Case {
  std::string name;
  double mass = 1, stiffness = 1;  // relative to nominal
  int late = 0;                    // additional delay, cycles
  double load = 0;                 // kg, unknown, at arm's length ahead
  double force_gain = 1;           // of the ankle sensors
  double loop = 1;                 // gain of both laws
  double limb_share = 0.2;         // of the mass, on a spring of its own
  double limb_hz = 8;              // with the legs held
  bool sees_limb = true;           // through the joints
  double noise = 1;
};

/// One axis: body and limb as masses at the height of the centre of mass, massless elastic legs.
class Robot {
 public:
  Robot(int axis, const Case& robot)
      : axis_(axis),
        case_(robot),
        mass_(robot.mass * kMass + robot.load),
        limb_(robot.limb_share * mass_),
        body_(mass_ - limb_),
        leg_(robot.stiffness * kStiffness[axis] / (kHeight * kHeight)),
        // 1 to 2 % of critical damping, as the springs have.
        leg_damping_(2 * 0.02 * std::sqrt(leg_ * mass_)),
        limb_spring_(limb_ * std::pow(2 * std::numbers::pi * robot.limb_hz, 2)),
        limb_damping_(2 * 0.02 * std::sqrt(limb_spring_ * limb_)),
        random_(7) {
    StabiliserOptions options;
    options.velocity_time *= robot.loop;
    options.cop_rate *= robot.loop;
    options.cop_leak *= robot.loop;
    stabiliser_ = Stabiliser(options);
    commands_.assign(3 + static_cast<std::size_t>(robot.late), 0.0);
  }

  /// Runs a cycle with the external force (N) on the body.
  void cycle(double push) {
    BalanceReading reading;
    const double com = com_now();
    const double force = ground_force(shift_);
    const double seen = case_.sees_limb ? com : x_[0];
    reading.p_Tcm[axis_] = seen + 0.005 + noise(2e-5);
    reading.force_T[axis_] = case_.force_gain * force + 10 + noise(0.5);
    reading.p_Tcp[axis_] = com - force / (mass_ * kGravityRate) + load_offset() + 0.002 + noise(1e-4);
    reading.load.fill(mass_ * kGravity / 2);
    commands_.push_back(stabiliser_.step(reading, kMass, Eigen::Vector2d::Zero(), kDt)[axis_]);
    // On the bus in one cycle, at the drives in the next, which move there in the third.
    commands_.pop_front();
    const double from = shift_;
    const int steps = static_cast<int>(std::lround(kDt / kStep));
    for (int i = 1; i <= steps; ++i) {
      shift_ = from + (commands_.front() - from) * i / steps;
      advance(push);
    }
  }

  [[nodiscard]] double com_now() const { return (body_ * x_[0] + limb_ * x_[1]) / mass_; }
  [[nodiscard]] double cop() const { return com_now() - ground_force(shift_) / (mass_ * kGravityRate); }
  [[nodiscard]] double velocity() const { return (body_ * v_[0] + limb_ * v_[1]) / mass_; }
  [[nodiscard]] double estimated() const { return stabiliser_.velocity()[axis_]; }
  [[nodiscard]] double shift() const { return shift_; }

 private:
  double noise(double deviation) { return case_.noise * deviation * normal_(random_); }
  [[nodiscard]] double load_offset() const { return 0.6 * case_.load / mass_; }
  /// The legs pull the body to the set-point position; gravity pulls everything away from the ankles.
  [[nodiscard]] double ground_force(double shift) const {
    return -leg_ * (x_[0] - shift) - leg_damping_ * v_[0] + mass_ * kGravityRate * com_now();
  }
  void advance(double push) {
    const double between = -limb_spring_ * (x_[1] - x_[0]) - limb_damping_ * (v_[1] - v_[0]);
    const double a_body = (ground_force(shift_) - between + push) / body_;
    const double a_limb = between / limb_;
    v_[0] += kStep * a_body;
    v_[1] += kStep * a_limb;
    x_[0] += kStep * v_[0];
    x_[1] += kStep * v_[1];
  }

  int axis_;
  Case case_;
  double mass_, limb_, body_, leg_, leg_damping_, limb_spring_, limb_damping_;
  double x_[2] = {0, 0}, v_[2] = {0, 0};
  double shift_ = 0;
  Stabiliser stabiliser_;
  std::deque<double> commands_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

struct Sway {
  double first = 0;  // maximum distance of the centre of mass after the push, m
  double late = 0;   // the same from 3 s after the push
  double cop = 0;    // maximum distance of the centre of pressure
};

Sway pushed(int axis, const Case& robot_case, double newtons = 100) {
  Robot robot(axis, robot_case);
  for (int i = 0; i < 1200; ++i) robot.cycle(0);  // for fade-in and learning the sensor biases
  const double rest = robot.com_now();
  Sway sway;
  for (int i = 0; i < 900; ++i) {
    const double time = i * kDt;
    robot.cycle(time < 0.1 ? newtons : 0);
    const double away = std::abs(robot.com_now() - rest);
    sway.first = std::max(sway.first, away);
    sway.cop = std::max(sway.cop, std::abs(robot.cop()));
    if (time > 3.1) sway.late = std::max(sway.late, away);
    if (!(away < 10)) return {1, 1, 1};
  }
  return sway;
}

/// Factor on the gains of both laws at which they no longer damp.
double gain_margin(int axis, Case robot_case) {
  robot_case.noise = 0;
  double loop = 1;
  while (loop < 40) {
    robot_case.loop = loop;
    const Sway sway = pushed(axis, robot_case, 5);
    if (sway.late > 0.05 * sway.first) return loop;
    loop *= 1.1;
  }
  return 40;
}

std::vector<Case> model_errors() {
  std::vector<Case> cases{
      {.name = "nominal"},
      {.name = "mass -5 %", .mass = 0.95},
      {.name = "mass +5 %", .mass = 1.05},
      {.name = "springs -10 %", .stiffness = 0.9},
      {.name = "springs +10 %", .stiffness = 1.1},
      {.name = "a cycle later", .late = 1},
      {.name = "4 kg in the hand", .load = 4},
      {.name = "force gain 0.8", .force_gain = 0.8},
      {.name = "force gain 1.2", .force_gain = 1.2},
      {.name = "all at once", .mass = 0.95, .stiffness = 1.1, .late = 1, .load = 4, .force_gain = 1.2}};
  for (const double hz : {3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 14.0, 20.0}) {
    cases.push_back({.name = "limb of " + std::to_string(static_cast<int>(hz)) + " Hz", .limb_hz = hz});
    cases.push_back({.name = "the same, unseen", .limb_hz = hz, .sees_limb = false});
  }
  return cases;
}

TEST(Stabiliser, DampsTheSwayOfARobotThatIsNotItsModel) {
  for (int axis = 0; axis < 2; ++axis) {
    for (const Case& robot : model_errors()) {
      const Sway sway = pushed(axis, robot);
      const double margin = gain_margin(axis, robot);
      EXPECT_LT(sway.late, 0.05 * sway.first + 1e-4) << axis << " " << robot.name;
      EXPECT_GT(margin, 2) << axis << " " << robot.name;
      std::printf("%s, %-18s sway %.1f mm, after 3 s %.2f %%, CoP %.0f mm, gain margin %.1f\n",
                  axis == 0 ? "along" : "across", robot.name.c_str(), 1e3 * sway.first,
                  100 * sway.late / sway.first, 1e3 * sway.cop, margin);
    }
  }
}

TEST(Stabiliser, ModelSwaysAsTheRobotWithout) {
  for (int axis = 0; axis < 2; ++axis) {
    Case still{.name = "without", .loop = 0, .limb_hz = 200, .noise = 0};
    still.limb_share = 1e-3;
    Robot robot(axis, still);
    for (int i = 0; i < 20; ++i) robot.cycle(100);
    std::vector<double> crossings;
    double last = robot.com_now();
    for (int i = 0; i < 2000; ++i) {
      robot.cycle(0);
      const double now = robot.com_now();
      if (last < 0 && now >= 0) crossings.push_back(i * kDt);
      last = now;
    }
    const double hz = static_cast<double>(crossings.size() - 1) / (crossings.back() - crossings.front());
    EXPECT_NEAR(hz, axis == 0 ? 1.24 : 2.35, 0.03);
    const Sway sway = pushed(axis, still);
    EXPECT_GT(sway.late, 0.3 * sway.first);
  }
}

TEST(Stabiliser, SeesTheVelocityThroughTheSensorsErrors) {
  for (int axis = 0; axis < 2; ++axis) {
    Robot robot(axis, {.name = "nominal"});
    for (int i = 0; i < 2000; ++i) robot.cycle(0);
    double square = 0;
    for (int i = 0; i < 1000; ++i) {
      robot.cycle(0);
      square += std::pow(robot.estimated() - robot.velocity(), 2);
    }
    EXPECT_LT(std::sqrt(square / 1000), 1e-3);  // m/s, at rest
    // The ankle sensors do not measure the push itself; half a second later the velocity is known all the
    // same.
    for (int i = 0; i < 20; ++i) robot.cycle(100);
    for (int i = 0; i < 100; ++i) robot.cycle(0);
    double worst = 0;
    for (int i = 0; i < 100; ++i) {
      robot.cycle(0);
      worst = std::max(worst, std::abs(robot.estimated() - robot.velocity()));
    }
    EXPECT_LT(worst, 0.006);
  }
}

TEST(Stabiliser, HasNoSayInWhereTheRobotStands) {
  for (int axis = 0; axis < 2; ++axis) {
    // Residuals and an unknown load are present from the start.
    Robot robot(axis, {.name = "4 kg in the hand", .load = 4});
    for (int i = 0; i < 6000; ++i) robot.cycle(0);
    EXPECT_LT(std::abs(robot.shift()), 2e-4);
  }
}

BalanceReading standing() {
  BalanceReading reading;
  reading.load.fill(500);
  return reading;
}

TEST(Stabiliser, ShiftIsSlowAndShort) {
  Stabiliser stabiliser;
  BalanceReading reading = standing();
  Eigen::Vector2d before = Eigen::Vector2d::Zero();
  double longest = 0;
  for (int i = 0; i < 2000; ++i) {
    reading.p_Tcm = Eigen::Vector2d(0.5, 0.3) * std::sin(i * kDt * 6);
    reading.p_Tcp = Eigen::Vector2d(0.2, -0.2) * std::sin(i * kDt * 3);
    reading.force_T = -36 * kMass * reading.p_Tcm;
    const Eigen::Vector2d shift = stabiliser.step(reading, kMass, Eigen::Vector2d::Zero(), kDt);
    EXPECT_LE((shift - before).norm(), 0.3 * kDt + 1e-12);
    before = shift;
    longest = std::max(longest, shift.norm());
  }
  EXPECT_NEAR(longest, 0.04, 1e-12);
}

TEST(Stabiliser, BeginsGently) {
  Stabiliser stabiliser;
  BalanceReading reading = standing();
  double early = 0, later = 0;
  for (int i = 0; i < 1000; ++i) {
    const double time = i * kDt;
    reading.p_Tcm.x() = 0.002 * std::sin(7.8 * time);
    reading.force_T.x() = -7.8 * 7.8 * kMass * reading.p_Tcm.x();
    const double shift = std::abs(stabiliser.step(reading, kMass, Eigen::Vector2d::Zero(), kDt).x());
    if (time < 0.1) early = std::max(early, shift);
    if (time > 2) later = std::max(later, shift);
  }
  EXPECT_NEAR(later, 0.06 * 7.8 * 0.002, 0.1 * later);
  EXPECT_LT(early, 0.15 * later);
}

TEST(Stabiliser, GoesOnFromItsShiftAfterAGap) {
  Stabiliser stabiliser;
  BalanceReading reading = standing();
  for (int i = 0; i < 400; ++i) {
    reading.p_Tcm.x() = 0.1 * std::sin(6 * i * kDt);
    stabiliser.step(reading, kMass, Eigen::Vector2d::Zero(), kDt);
  }
  const double before = stabiliser.shift().x();
  ASSERT_GT(std::abs(before), 0.003);
  stabiliser.restart();
  reading = standing();
  reading.p_Tcm.x() = -0.3;  // regardless of the present position
  const double after = stabiliser.step(reading, kMass, Eigen::Vector2d::Zero(), kDt).x();
  EXPECT_LE(std::abs(after - before), 0.3 * kDt + 1e-12);
  for (int i = 0; i < 200; ++i) stabiliser.step(reading, kMass, Eigen::Vector2d::Zero(), kDt);
  EXPECT_NEAR(stabiliser.shift().x(), 0, 1e-6);
}

TEST(Stabiliser, CentreOfPressureOfOneFootIsLeftAlone) {
  Stabiliser both, one;
  BalanceReading reading = standing();
  for (int i = 0; i < 400; ++i) {
    reading.p_Tcp.x() = i < 300 ? 0 : 0.05;
    both.step(reading, kMass, Eigen::Vector2d::Zero(), kDt);
    BalanceReading lifted = reading;
    lifted.load = {1150, 10};
    one.step(lifted, kMass, Eigen::Vector2d::Zero(), kDt);
  }
  EXPECT_GT(both.shift().x(), 0.004);
  EXPECT_EQ(one.shift().x(), 0);
}

TEST(Stabiliser, AReferenceThatMovesIsNoSway) {
  Stabiliser stabiliser;
  BalanceReading reading = standing();
  double worst = 0;
  for (int i = 0; i < 1000; ++i) {
    const double time = i * kDt;
    const double x = time < 2 ? 0 : 0.02 * (1 - std::cos(1.5 * (time - 2)));
    const double a = time < 2 ? 0 : 0.02 * 1.5 * 1.5 * std::cos(1.5 * (time - 2));
    reading.p_Tcm.x() = x;
    reading.p_Tcp.x() = x - a / kGravityRate;
    reading.force_T.x() = kMass * a;
    worst = std::max(worst, std::abs(stabiliser.step(reading, kMass, Eigen::Vector2d(x, 0), kDt).x()));
  }
  EXPECT_LT(worst, 0.0015);  // for 20 mm of motion at 30 mm/s
}

}  // namespace
}  // namespace walkman::motion
