#include "emulator/plant/contact/collider_parts.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <btBulletCollisionCommon.h>
#include <gtest/gtest.h>

namespace walkman::plant {
namespace {

TEST(ColliderParts, HasTravelledNoLessThanAnyCornerOfItsBoxes) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> draw;
  const auto vector = [&](double spread) {
    return btVector3(draw(random), draw(random), draw(random)) * spread;
  };
  const auto turn = [&](double angle) { return btQuaternion(vector(1).normalized(), angle); };

  const btBoxShape box(btVector3(0.1, 0.2, 0.05));
  ColliderParts parts;
  for (int i = 0; i < 3; ++i)
    parts.add({std::nullopt, &box, btTransform(turn(2 * draw(random)), vector(0.2)), Surface{}});
  btCollisionObject object;
  object.setWorldTransform(btTransform(turn(1), vector(1)));
  parts.hang_on(object);

  const auto corners = [&] {
    std::vector<btVector3> points;
    for (const ColliderPart& part : parts.parts()) {
      for (int c = 0; c < 8; ++c) {
        const btVector3 p_C((c & 1) != 0 ? 0.1 : -0.1, (c & 2) != 0 ? 0.2 : -0.2,
                            (c & 4) != 0 ? 0.05 : -0.05);
        points.push_back(object.getWorldTransform() * (part.X_MC * p_C));
      }
    }
    return points;
  };
  std::vector<btVector3> before = corners();
  double travelled = parts.travelled(0);
  EXPECT_EQ(travelled, 0);
  double tightest = 0;
  for (long search = 1; search < 400; ++search) {
    const double size =
        std::pow(10, -6 + 6 * static_cast<double>(search) / 400);  // 1 µrad and µm to 1 rad and m
    btTransform& pose = object.getWorldTransform();
    pose.setOrigin(pose.getOrigin() + vector(size));
    pose.setBasis(btMatrix3x3(turn(size * draw(random))) * pose.getBasis());
    const std::vector<btVector3> now = corners();
    double farthest = 0;
    for (std::size_t i = 0; i < now.size(); ++i)
      farthest = std::max(farthest, static_cast<double>((now[i] - before[i]).length()));
    const double step = parts.travelled(search) - travelled;
    EXPECT_GE(step, farthest * (1 - 1e-9)) << search;
    EXPECT_EQ(parts.travelled(search), travelled + step) << "asked twice in a search";
    tightest = std::max(tightest, farthest / step);
    travelled += step;
    before = now;
  }
  EXPECT_GT(tightest, 0.8);  // the bound is not much larger than the distance
}

TEST(ColliderParts, OfABodyThatStandsStillHasTravelledNowhere) {
  const btBoxShape box(btVector3(1, 1, 1));
  ColliderParts parts;
  parts.add({std::nullopt, &box, btTransform::getIdentity(), Surface{}});
  btCollisionObject object;
  parts.hang_on(object);
  for (long search = 0; search < 10; ++search) EXPECT_EQ(parts.travelled(search), 0);
}

}  // namespace
}  // namespace walkman::plant
