// Solids on a plate, compared with Coulomb's and Newton's laws: the slope at which a block begins to slip and
// its speed then, the push at which it tips, the energy left after a drop, and whether a stack stands.

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/unit/plant/contact_world.h"

namespace walkman::plant {
namespace {

constexpr double kGravity = ContactWorld::kGravity;
constexpr double kDegree = std::numbers::pi / 180;

Surface surface(double friction, double restitution = 0) {
  Surface out;
  out.friction = friction;
  out.restitution = restitution;
  return out;
}

/// A plate whose top passes through the origin, tilted by `slope` about y: down is along x.
Eigen::Isometry3d tilted(double slope) {
  return Eigen::Isometry3d(Eigen::AngleAxisd(slope, Eigen::Vector3d::UnitY()));
}

void add_plate(ContactWorld& world, double slope, const Surface& top) {
  world.add_fixed(BoxShape{{40, 40, 1}}, tilted(slope) * at(0, 0, -0.5), top);
}

struct InclineCase {
  const char* name;
  Shape shape;
  double height;  // of its centre above the plate, m
  double yaw;     // about the plate's normal
};

class Incline : public testing::TestWithParam<InclineCase> {};

/// A block at rest on a slope, its centre on the normal through the origin.
class BlockOnSlope {
 public:
  BlockOnSlope(const InclineCase& given, double friction, double slope) : slope_(slope) {
    add_plate(world_, slope, surface(1));
    Eigen::Isometry3d X_WB = tilted(slope) * at(0, 0, given.height);
    X_WB.rotate(Eigen::AngleAxisd(given.yaw, Eigen::Vector3d::UnitZ()));
    world_.add(given.shape, 2, X_WB, surface(friction));
    world_.run(0.2);
  }
  /// Returns how far it moves, m.
  double run(double seconds) {
    const Eigen::Vector3d before = world_.X_WB(0).translation();
    world_.run(seconds);
    return (world_.X_WB(0).translation() - before).norm();
  }
  [[nodiscard]] double speed() const { return (tilted(slope_).linear().transpose() * world_.v_WB(0)).x(); }

 private:
  ContactWorld world_;
  double slope_;
};

/// A block slips where the slope's tangent equals the friction, to a tenth of a degree, in any orientation;
/// well below that it does not creep.
TEST_P(Incline, SlipsWhereCoulombSays) {
  for (const double friction : {0.3, 0.6, 1.0}) {
    constexpr double kSeconds = 5;
    BlockOnSlope well_below(GetParam(), friction, std::atan(0.9 * friction));
    EXPECT_LT(well_below.run(kSeconds), 1e-6) << friction;
    BlockOnSlope below(GetParam(), friction, std::atan(friction) - 0.1 * kDegree);
    EXPECT_LT(below.run(kSeconds), 5e-4) << friction;
    const double slope = std::atan(friction) + 0.1 * kDegree;
    BlockOnSlope above(GetParam(), friction, slope);
    const double acceleration = kGravity * (std::sin(slope) - friction * std::cos(slope));
    const double expected = above.speed() * kSeconds + acceleration * kSeconds * kSeconds / 2;
    EXPECT_NEAR(above.run(kSeconds), expected, 0.01 * expected) << friction;
  }
}

INSTANTIATE_TEST_SUITE_P(Blocks, Incline,
                         testing::Values(InclineCase{"box", BoxShape{{0.2, 0.2, 0.05}}, 0.025, 0},
                                         InclineCase{"turned_box", BoxShape{{0.3, 0.2, 0.05}}, 0.025, 0.6},
                                         InclineCase{"upright_cylinder", CylinderShape{0.1, 0.05}, 0.025, 0},
                                         InclineCase{"mesh", prism(4, 0.14, 0.05), 0.025, 0},
                                         InclineCase{"turned_mesh", prism(6, 0.12, 0.05), 0.025, 0.4}),
                         [](const auto& one) { return one.param.name; });

/// A push at the centre of a block on a rough floor tips it about its edge if F h/2 exceeds m g w/2.
TEST(Tipping, BeginsWhereTheMomentsAreEqual) {
  constexpr double kMass = 2, kWidth = 0.1, kHeight = 0.3;
  constexpr double kLimit = kMass * kGravity * kWidth / kHeight;  // N
  for (const double share : {0.999, 1.001}) {
    ContactWorld world;
    add_plate(world, 0, surface(1));
    world.add(BoxShape{{kWidth, kWidth, kHeight}}, kMass, at(0, 0, kHeight / 2), surface(1));
    world.run(0.2);
    for (int i = 0; i < 3000; ++i) {
      world.push(0, {share * kLimit, 0, 0});
      world.step();
    }
    const double tilt = std::acos(std::clamp(world.X_WB(0).linear()(2, 2), -1.0, 1.0));
    if (share < 1) {
      EXPECT_LT(tilt, 1e-4);
    } else {
      EXPECT_GT(tilt, 0.05);
    }
  }
}

struct DropCase {
  const char* name;
  Shape shape;
  double height;  // of the centre when it rests, m
  Eigen::Vector3d turned;
};

class Drop : public testing::TestWithParam<DropCase> {};

/// Energy only decreases; a body that does not bounce comes to rest where it should.
TEST_P(Drop, NeverGainsEnergy) {
  const DropCase& given = GetParam();
  ContactWorld world;
  add_plate(world, 0, surface(0.8));
  Eigen::Isometry3d X_WB = at(0, 0, 0.5);
  if (given.turned.norm() > 0) X_WB.rotate(Eigen::AngleAxisd(given.turned.norm(), given.turned.normalized()));
  world.add(given.shape, 1.5, X_WB, surface(0.8));
  const double first = world.energy(0);
  double last = first, gained = 0;
  for (int i = 0; i < 5000; ++i) {
    world.step();
    gained = std::max(gained, world.energy(0) - last);
    last = world.energy(0);
  }
  EXPECT_LT(gained, 1e-4 * first);
  EXPECT_LT(world.v_WB(0).norm(), 0.01);
  EXPECT_NEAR(world.X_WB(0).translation().z(), given.height, 2e-4);
}

INSTANTIATE_TEST_SUITE_P(
    Solids, Drop,
    testing::Values(DropCase{"flat_box", BoxShape{{0.2, 0.15, 0.1}}, 0.05, {0, 0, 0}},
                    DropCase{"tilted_box", BoxShape{{0.2, 0.2, 0.2}}, 0.1, {0.3, 0.2, 0.1}},
                    DropCase{"box_on_its_corner", BoxShape{{0.2, 0.2, 0.2}}, 0.1, {0.615, 0.785, 0}},
                    DropCase{"lying_cylinder", CylinderShape{0.05, 0.4}, 0.05, {std::numbers::pi / 2, 0, 0}},
                    DropCase{"sphere", SphereShape{0.05}, 0.05, {0, 0, 0}},
                    DropCase{"tilted_mesh", prism(4, 0.1 * std::numbers::sqrt2, 0.2), 0.1, {0.3, 0.2, 0.1}}),
    [](const auto& one) { return one.param.name; });

/// A bar made of a mesh lies on four balls where it was put, and does not slip off any of them under less
/// than its friction.
TEST(Mesh, RestsOnBalls) {
  constexpr double kRadius = 0.01, kMass = 1.5, kFriction = 0.6;
  ContactWorld world;
  for (const double x : {-0.1, 0.1})
    for (const double y : {-0.03, 0.03}) world.add_fixed(SphereShape{kRadius}, at(x, y, kRadius), surface(1));
  const double half = 0.05 / std::numbers::sqrt2;
  world.add(prism(4, 0.05, 0.4), kMass,
            at(0, 0, 2 * kRadius + half) * Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitY()),
            surface(kFriction));
  world.run(1);
  const Eigen::Vector3d put = world.X_WB(0).translation();
  EXPECT_NEAR(put.z(), 2 * kRadius + half, 2e-4);
  for (int i = 0; i < 3000; ++i) {
    world.push(0, {0.9 * kFriction * kMass * kGravity, 0, 0});
    world.step();
  }
  EXPECT_LT((world.X_WB(0).translation() - put).norm(), 5e-4);
  for (int i = 0; i < 500; ++i) {
    world.push(0, {1.1 * kFriction * kMass * kGravity, 0, 0});
    world.step();
  }
  EXPECT_GT(world.v_WB(0).x(), 0.4 * 0.1 * kFriction * kGravity);
}

/// The height of a bounce is e² times the drop.
TEST(Bounce, ComesBackWithItsRestitution) {
  for (const double restitution : {0.3, 0.6, 0.9}) {
    ContactWorld world;
    add_plate(world, 0, surface(0.5, 1));
    world.add(SphereShape{0.05}, 1, at(0, 0, 1.05), surface(0.5, restitution));
    double highest = 0;
    bool bounced = false;
    for (int i = 0; i < 1000; ++i) {
      world.step();
      bounced = bounced || world.v_WB(0).z() > 0;
      if (bounced) highest = std::max(highest, world.X_WB(0).translation().z() - 0.05);
    }
    // The instant of the impact is known to within a step, in which it falls 4 mm.
    EXPECT_NEAR(highest, restitution * restitution, 0.01);
  }
}

class Stack : public testing::TestWithParam<double> {};

/// Ten boxes, the top one heavier than the bottom one by the given ratio: they stand where they were put.
TEST_P(Stack, Stands) {
  constexpr double kEdge = 0.1;
  constexpr int kBoxes = 10;
  const double ratio = GetParam();
  ContactWorld world;
  add_plate(world, 0, surface(0.8));
  for (int i = 0; i < kBoxes; ++i) {
    const double mass = 0.5 * std::pow(ratio, static_cast<double>(i) / (kBoxes - 1));
    world.add(BoxShape{{kEdge, kEdge, kEdge}}, mass, at(0, 0, kEdge * (i + 0.5)), surface(0.8));
  }
  world.run(10);
  for (std::size_t i = 0; i < kBoxes; ++i) {
    const Eigen::Vector3d p = world.X_WB(i).translation();
    EXPECT_LT(p.head<2>().norm(), 1e-3) << i;
    EXPECT_NEAR(p.z(), kEdge * (static_cast<double>(i) + 0.5), 1e-3) << i;
    EXPECT_LT(world.v_WB(i).norm(), 1e-3) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(HeaviestOverLightest, Stack, testing::Values(1.0, 10.0, 0.1), [](const auto& one) {
  return "times_" + std::to_string(static_cast<int>(std::lround(10 * one.param))) + "_tenths";
});

/// One heavy box on top of a light one.
TEST(Stack, OfAHundredTimesTheWeightStands) {
  ContactWorld world;
  add_plate(world, 0, surface(0.8));
  world.add(BoxShape{{0.1, 0.1, 0.1}}, 0.5, at(0, 0, 0.05), surface(0.8));
  world.add(BoxShape{{0.1, 0.1, 0.1}}, 50, at(0, 0, 0.15), surface(0.8));
  world.run(10);
  EXPECT_NEAR(world.X_WB(0).translation().z(), 0.05, 1e-3);
  EXPECT_NEAR(world.X_WB(1).translation().z(), 0.15, 2e-3);
  EXPECT_LT(world.X_WB(1).translation().head<2>().norm(), 1e-4);
}

}  // namespace
}  // namespace walkman::plant
