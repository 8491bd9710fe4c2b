// Rolling bodies compared with Newton's laws: they keep their speed on a level floor, gain g sin α / (1 +
// I/mr²) on an incline, stay where they rest, and slow down by their rolling friction.

#include <cmath>
#include <memory>
#include <numbers>

#include <gtest/gtest.h>

#include "emulator/plant/contact/bullet_types.h"
#include "emulator/plant/contact/contact_dispatcher.h"
#include "emulator/plant/dynamics/plant_world.h"
#include "emulator/plant/dynamics/row_space_solver.h"
#include "emulator/plant/dynamics/world_objects.h"

namespace walkman::plant {
namespace {

constexpr double kPeriod = 1e-3;
constexpr double kStandardGravity = 9.81;
constexpr double kMass = 1.2;

enum class Round { kCylinder, kTube, kSphere };

/// A body with a single link, its axis along y.
RobotModel round_body(Round kind, double radius, double length, const Surface& surface) {
  RobotModel model;
  Link link;
  link.name = "round";
  link.mass = kMass;
  link.surface = surface;
  const double rr = radius * radius;
  double about = kMass * rr / 2;
  double across = kMass * (3 * rr + length * length) / 12;
  LinkGeometry geometry;
  geometry.shape = CylinderShape{radius, length};
  geometry.X_LG.linear() =
      Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX()).toRotationMatrix();
  if (kind == Round::kTube) {
    about = kMass * rr;
    across = kMass * (6 * rr + length * length) / 12;
  }
  if (kind == Round::kSphere) {
    about = across = 0.4 * kMass * rr;
    geometry.shape = SphereShape{radius};
  }
  link.I_LLcm_L = Eigen::Vector3d(across, about, across).asDiagonal();
  link.collisions.push_back(geometry);
  model.links.push_back(link);
  return model;
}

/// A round body on a plate whose top passes through the origin, tilted by `slope` about y: the slope descends
/// along x.
class RoundOnPlate {
 public:
  RoundOnPlate(Round kind, double radius, double length, double slope = 0, const Surface& surface = {1.0})
      : model_(round_body(kind, radius, length, surface)), slope_(slope) {
    world_.setGravity(btVector3(0, 0, -kStandardGravity));
    world_.use_mid_step_velocities();
    world_.getSolverInfo().m_numIterations = 50;
    world_.getSolverInfo().m_linearSlop = 1e-5;
    FixedBody plate;
    plate.name = "plate";
    Link link;
    link.name = "plate";
    link.surface.friction = 1;
    LinkGeometry geometry;
    geometry.shape = BoxShape{{20, 20, 1}};
    geometry.X_LG.translation().z() = -0.5;
    link.collisions.push_back(geometry);
    plate.model.links.push_back(link);
    const Eigen::AngleAxisd tilt(slope, Eigen::Vector3d::UnitY());
    plate.X_WF.linear() = tilt.toRotationMatrix();
    plate_ = std::make_unique<StaticBody>(world_, plate);
    Eigen::Isometry3d X_WB(tilt);
    X_WB.translation() = tilt * Eigen::Vector3d(0, 0, radius);
    body_ = std::make_unique<Multibody>(world_, model_, RigidTree(model_, {}, {}), false, X_WB, kObjectGroup,
                                        kObjectGroup | kFixedGroup);
  }
  /// Sets the state of a body that has been rolling with this speed along x.
  void roll(double speed, double radius) {
    body_->bullet().setBaseVel(btVector3(speed, 0, 0));
    body_->bullet().setBaseOmega(btVector3(0, speed / radius, 0));
  }
  void spin(double rate) { body_->bullet().setBaseOmega(btVector3(0, 0, rate)); }
  [[nodiscard]] double spinning() const { return body_->bullet().getBaseOmega().z(); }
  void run(double seconds) {
    for (int i = 0; i < std::lround(seconds / kPeriod); ++i) world_.stepSimulation(kPeriod, 0);
  }
  /// Speed down the plate, m/s.
  [[nodiscard]] double speed() const {
    return from_bullet(body_->bullet().getBaseVel())
        .dot(Eigen::Vector3d(std::cos(slope_), 0, -std::sin(slope_)));
  }
  [[nodiscard]] Eigen::Isometry3d pose() const { return body_->X_WL(0); }

 private:
  RobotModel model_;
  double slope_;
  btDefaultCollisionConfiguration configuration_;
  ContactDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  RowSpaceSolver solver_;
  PlantWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  std::unique_ptr<StaticBody> plate_;
  std::unique_ptr<Multibody> body_;
};

struct Case {
  Round kind;
  double radius, length;
};

class RoundThings : public testing::TestWithParam<Case> {};

TEST_P(RoundThings, KeepTheirSpeedOnALevelFloor) {
  const auto [kind, radius, length] = GetParam();
  for (const double speed : {0.02, 0.2, 1.0}) {
    RoundOnPlate scene(kind, radius, length);
    scene.run(0.2);
    scene.roll(speed, radius);
    scene.run(8);
    EXPECT_NEAR(scene.speed(), speed, 0.005 * speed);
    EXPECT_NEAR(scene.pose().translation().y(), 0, 1e-3);
  }
}

TEST_P(RoundThings, StayWhereTheyRest) {
  const auto [kind, radius, length] = GetParam();
  RoundOnPlate scene(kind, radius, length);
  scene.run(0.2);
  const Eigen::Vector3d before = scene.pose().translation();
  scene.run(60);
  EXPECT_LT((scene.pose().translation() - before).norm(), 1e-4);
}

TEST_P(RoundThings, RollDownAnInclineAsNewtonSays) {
  const auto [kind, radius, length] = GetParam();
  const double share = kind == Round::kCylinder ? 0.5 : kind == Round::kTube ? 1 : 0.4;  // I / m r²
  for (const double slope : {0.02, 0.2, 0.4}) {
    RoundOnPlate scene(kind, radius, length, slope);
    scene.run(1.5);
    EXPECT_NEAR(scene.speed(), kStandardGravity * std::sin(slope) / (1 + share) * 1.5,
                0.005 * kStandardGravity * std::sin(slope) * 1.5);
  }
}

TEST_P(RoundThings, SlowDownByRollingFriction) {
  const auto [kind, radius, length] = GetParam();
  const double share = kind == Round::kCylinder ? 0.5 : kind == Round::kTube ? 1 : 0.4;
  Surface surface{1.0};
  surface.rolling_friction = 0.001;  // m
  RoundOnPlate scene(kind, radius, length, 0, surface);
  scene.run(0.2);
  scene.roll(0.5, radius);
  scene.run(1);
  // The moment δ m g about the contact acts against I + m r².
  const double slowing = surface.rolling_friction * kStandardGravity / (radius * (1 + share));
  EXPECT_NEAR(scene.speed(), 0.5 - slowing, 0.01 * slowing + 0.002);
}

INSTANTIATE_TEST_SUITE_P(Sizes, RoundThings,
                         testing::Values(Case{Round::kTube, 0.035, 1.05}, Case{Round::kCylinder, 0.035, 1.05},
                                         Case{Round::kCylinder, 0.02, 0.3},
                                         Case{Round::kCylinder, 0.045, 0.1}, Case{Round::kSphere, 0.05, 0}));

TEST(Spinning, StopsAsItsFrictionSays) {
  Surface surface{1.0};
  surface.spinning_friction = 0.002;  // m
  RoundOnPlate scene(Round::kSphere, 0.05, 0, 0, surface);
  scene.run(0.2);
  scene.spin(20);
  scene.run(0.5);
  // The moment δ m g about the normal acts against 2/5 m r².
  const double slowing = surface.spinning_friction * kStandardGravity / (0.4 * 0.05 * 0.05);
  EXPECT_NEAR(scene.spinning(), 20 - slowing * 0.5, 0.02 * slowing * 0.5);
  scene.run(2);
  EXPECT_NEAR(scene.spinning(), 0, 1e-6);
}

}  // namespace
}  // namespace walkman::plant
