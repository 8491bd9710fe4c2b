// Contacts in closed form compared with Bullet's GJK and with the geometry of resting solids.

#include "emulator/plant/contact/primitive.h"

#include <algorithm>
#include <memory>
#include <random>

#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btPointCollector.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>
#include <btBulletCollisionCommon.h>
#include <gtest/gtest.h>

#include "emulator/plant/contact/collider_parts.h"

namespace walkman::plant {
namespace {

using Kind = Primitive::Kind;

/// Random solids and poses.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : random_(seed) {}
  double within(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Primitive solid(Kind kind) {
    Primitive p;
    p.kind = kind;
    if (kind == Kind::kBox) {
      p.half = {within(0.02, 0.2), within(0.02, 0.2), within(0.02, 0.2)};
      return p;
    }
    p.radius = within(0.01, 0.1);
    if (kind != Kind::kSphere) p.half_length = within(0.02, 0.3);
    return p;
  }
  btTransform pose(double spread) {
    std::normal_distribution<double> normal;
    btQuaternion q(normal(random_), normal(random_), normal(random_), normal(random_));
    q.normalize();
    return btTransform(q, {within(-spread, spread), within(-spread, spread), within(-spread, spread)});
  }

 private:
  std::mt19937_64 random_;
};

/// Distance by GJK, negative by EPA.
double bullets_distance(const Primitive& a, const btTransform& X_WA, const Primitive& b,
                        const btTransform& X_WB) {
  const auto shape_a = make_shape({Eigen::Isometry3d::Identity(), a, nullptr});
  const auto shape_b = make_shape({Eigen::Isometry3d::Identity(), b, nullptr});
  // A margin would round edges; a sphere's margin is its radius.
  for (const auto& [solid, shape] : {std::pair{&a, &shape_a}, std::pair{&b, &shape_b}}) {
    if (solid->kind == Kind::kCylinder || solid->kind == Kind::kBox) (*shape)->setMargin(0);
  }
  btVoronoiSimplexSolver simplex;
  btGjkEpaPenetrationDepthSolver depth;
  btGjkPairDetector detector(static_cast<btConvexShape*>(shape_a.get()),
                             static_cast<btConvexShape*>(shape_b.get()), &simplex, &depth);
  btPointCollector collector;
  btGjkPairDetector::ClosestPointInput input;
  input.m_transformA = X_WA;
  input.m_transformB = X_WB;
  detector.getClosestPoints(input, collector, nullptr);
  EXPECT_TRUE(collector.m_hasResult);
  return collector.m_distance;
}

double least(const Touches& touches) {
  double distance = 1e9;
  for (int i = 0; i < touches.count; ++i)
    distance = std::min(distance, touches.at[static_cast<std::size_t>(i)].distance);
  return distance;
}

class Pairs : public testing::TestWithParam<std::pair<Kind, Kind>> {};
class RoundOnes : public testing::TestWithParam<std::pair<Kind, Kind>> {};

// At any distance: a shape swept by a sphere has a single nearest point.
TEST_P(RoundOnes, AreAsFarApartAsGjkSays) {
  Draws draws(7);
  int apart = 0;
  int overlapping = 0;
  for (int i = 0; i < 4000; ++i) {
    const Primitive a = draws.solid(GetParam().first);
    const Primitive b = draws.solid(GetParam().second);
    const btTransform X_WA = draws.pose(0.2);
    const btTransform X_WB = draws.pose(0.2);
    const double theirs = bullets_distance(a, X_WA, b, X_WB);
    const Touches touches = touches_of(a, X_WA, b, X_WB, 1);
    ASSERT_GT(touches.count, 0) << i << ": " << theirs;
    if (theirs > 0) {
      ++apart;
      EXPECT_NEAR(least(touches), theirs, 5e-5) << i;
    } else {
      ++overlapping;
      EXPECT_LT(least(touches), 5e-5) << i;
    }
    for (int k = 0; k < touches.count; ++k) {
      const Touch& t = touches.at[static_cast<std::size_t>(k)];
      EXPECT_NEAR(t.normal_W.length(), 1, 1e-9);
      EXPECT_NEAR((t.p_WA - t.p_WB).dot(t.normal_W), t.distance, 1e-9) << i;
      EXPECT_LT(nearest(b, X_WB.invXform(t.p_WB)).distance, 1e-6) << i;
    }
  }
  EXPECT_GT(apart, 500);
  EXPECT_GT(overlapping, 50);
}

INSTANTIATE_TEST_SUITE_P(
    Solids, RoundOnes,
    testing::Values(std::pair{Kind::kSphere, Kind::kSphere}, std::pair{Kind::kSphere, Kind::kCapsule},
                    std::pair{Kind::kSphere, Kind::kCylinder}, std::pair{Kind::kSphere, Kind::kBox},
                    std::pair{Kind::kCapsule, Kind::kCapsule}, std::pair{Kind::kCapsule, Kind::kCylinder},
                    std::pair{Kind::kCapsule, Kind::kBox}, std::pair{Kind::kBox, Kind::kCapsule}));

TEST_P(Pairs, WithinAMillimetreTheDistanceIsGjks) {
  // As in the world: shapes are moved towards each other until they nearly or just touch.
  Draws draws(8);
  int met = 0;
  int off_by_much = 0;
  for (int i = 0; i < 2000; ++i) {
    const Primitive a = draws.solid(GetParam().first);
    const Primitive b = draws.solid(GetParam().second);
    btTransform X_WA = draws.pose(0.5);
    const btTransform X_WB = draws.pose(0.1);
    for (int k = 0; k < 20; ++k) {
      const double d = bullets_distance(a, X_WA, b, X_WB);
      if (std::abs(d) < 9e-4) break;
      const btVector3 away = X_WA.getOrigin() - X_WB.getOrigin();
      X_WA.setOrigin(X_WA.getOrigin() - away.normalized() * (d - 2e-4));
    }
    const double theirs = bullets_distance(a, X_WA, b, X_WB);
    if (std::abs(theirs) > 9e-4) continue;
    const Touches touches = touches_of(a, X_WA, b, X_WB, 1e-3);
    ASSERT_GT(touches.count, 0) << i << ": " << theirs;
    // Where an edge has entered a rim, the depth is that of the edge in the cylinder: slightly less than the
    // distance that would separate the two.
    const double off = std::abs(least(touches) - theirs);
    EXPECT_LT(off, 6e-4) << i;
    ++met;
    if (off > 1e-4) ++off_by_much;
  }
  EXPECT_GT(met, 500);
  EXPECT_LT(off_by_much, met / 50);
}

INSTANTIATE_TEST_SUITE_P(
    Solids, Pairs,
    testing::Values(std::pair{Kind::kSphere, Kind::kSphere}, std::pair{Kind::kSphere, Kind::kCapsule},
                    std::pair{Kind::kSphere, Kind::kCylinder}, std::pair{Kind::kSphere, Kind::kBox},
                    std::pair{Kind::kCapsule, Kind::kCapsule}, std::pair{Kind::kCapsule, Kind::kCylinder},
                    std::pair{Kind::kCapsule, Kind::kBox}, std::pair{Kind::kBox, Kind::kCapsule},
                    std::pair{Kind::kCylinder, Kind::kBox}, std::pair{Kind::kBox, Kind::kCylinder},
                    std::pair{Kind::kBox, Kind::kBox}));

Primitive box(double x, double y, double z) { return {Kind::kBox, 0, 0, {x, y, z}}; }
Primitive cylinder(double radius, double half_length) {
  return {Kind::kCylinder, radius, half_length, {0, 0, 0}};
}
btTransform at(double x, double y, double z, const btQuaternion& q = btQuaternion::getIdentity()) {
  return btTransform(q, {x, y, z});
}

TEST(Resting, ABoxStandsOnItsFourCorners) {
  const Touches touches =
      touches_of(box(0.1, 0.2, 0.05), at(0.3, 0.1, 0.0499), box(2, 2, 0.5), at(0, 0, -0.5), 1e-3);
  ASSERT_EQ(touches.count, 4);
  btVector3 sum(0, 0, 0);
  for (const Touch& t : touches) {
    EXPECT_NEAR(t.distance, -1e-4, 1e-12);
    EXPECT_NEAR(t.normal_W.z(), 1, 1e-12);
    EXPECT_NEAR(std::abs(t.p_WB.x() - 0.3), 0.1, 1e-12);
    EXPECT_NEAR(std::abs(t.p_WB.y() - 0.1), 0.2, 1e-12);
    sum += t.p_WB;
  }
  EXPECT_NEAR(sum.x() / 4, 0.3, 1e-12);
  EXPECT_NEAR(sum.y() / 4, 0.1, 1e-12);
}

TEST(Resting, ACylinderLiesOnTheLineBelowItsAxisUpToTheEdge) {
  const btQuaternion lying(btVector3(0, 1, 0), SIMD_HALF_PI);  // its axis along x
  const Touches touches =
      touches_of(cylinder(0.035, 0.5), at(0.8, 0, 0.9349, lying), box(0.6, 0.4, 0.45), at(0, 0, 0.45), 1e-3);
  ASSERT_EQ(touches.count, 2);
  std::array<double, 2> x = {touches.at[0].p_WB.x(), touches.at[1].p_WB.x()};
  std::sort(x.begin(), x.end());
  EXPECT_NEAR(x[0], 0.3, 1e-9);
  EXPECT_NEAR(x[1], 0.6, 1e-9);  // there is no table beyond it
  for (int i = 0; i < 2; ++i) {
    EXPECT_NEAR(touches.at[static_cast<std::size_t>(i)].distance, -1e-4, 1e-9);
    EXPECT_NEAR(touches.at[static_cast<std::size_t>(i)].p_WB.y(), 0, 1e-9);
  }
}

TEST(Resting, ALongCylinderLiesOnBothEdgesOfASoftFaceWithItsEndBelowThePlane) {
  const double radius = 0.035, half_face = 0.055, overlap = 0.006;
  for (const double tilt : {0.0, 0.02, 0.04, 0.06, 0.08, 0.1}) {
    const btQuaternion leaning(btVector3(0, 1, 0), SIMD_HALF_PI + tilt);
    const Touches touches =
        touches_of(cylinder(radius, 0.5), at(0, 0, radius / std::cos(tilt) - overlap, leaning),
                   box(half_face, 0.04, 0.012), at(0, 0, -0.012), 1e-3);
    ASSERT_EQ(touches.count, 2) << tilt;
    for (int i = 0; i < 2; ++i) {
      const Touch& touch = touches.at[static_cast<std::size_t>(i)];
      EXPECT_NEAR(std::abs(touch.p_WB.x()), half_face, 1e-9);
      EXPECT_NEAR(touch.distance, -overlap - touch.p_WB.x() * std::tan(tilt), 1e-9) << tilt;
      EXPECT_NEAR(touch.normal_W.z(), 1, 1e-9);
    }
    EXPECT_LT(touches.at[0].p_WB.x() * touches.at[1].p_WB.x(), 0);
  }
}

TEST(Resting, ACylinderStandsOnItsRim) {
  const Touches touches = touches_of(cylinder(0.1, 0.2), at(0, 0, 0.2), box(2, 2, 0.5), at(0, 0, -0.5), 1e-3);
  ASSERT_EQ(touches.count, 4);
  for (const Touch& t : touches) EXPECT_NEAR(t.p_WB.length(), 0.1, 1e-9);
}

TEST(Resting, ABoxStandsOnAPost) {
  // All contact points are within the post's end.
  const Touches touches =
      touches_of(box(0.3, 0.3, 0.05), at(0.02, 0, 0.05), cylinder(0.1, 0.5), at(0, 0, -0.5), 1e-3);
  ASSERT_GE(touches.count, 3);
  for (int i = 0; i < touches.count; ++i) {
    const btVector3& p = touches.at[static_cast<std::size_t>(i)].p_WB;
    EXPECT_LE(std::hypot(p.x(), p.y()), 0.1 + 1e-9);
  }
}

TEST(Capsules, AreJoinedOfACylinderAndItsEnds) {
  const auto geometry = [](double z, auto shape) {
    LinkGeometry g;
    g.X_LG.translation().z() = z;
    g.shape = shape;
    return g;
  };
  const std::vector<Solid> solids =
      solids_of({geometry(0, SphereShape{0.01}), geometry(0.02, CylinderShape{0.01, 0.04}),
                 geometry(0.04, SphereShape{0.01}), geometry(0.3, SphereShape{0.01}),
                 geometry(0.5, CylinderShape{0.02, 0.04})});
  ASSERT_EQ(solids.size(), 3U);
  EXPECT_EQ(solids[0].primitive->kind, Kind::kCapsule);
  EXPECT_EQ(solids[0].primitive->half_length, 0.02);
  EXPECT_EQ(solids[1].primitive->kind, Kind::kSphere);
  EXPECT_EQ(solids[2].primitive->kind, Kind::kCylinder);
}

}  // namespace
}  // namespace walkman::plant
