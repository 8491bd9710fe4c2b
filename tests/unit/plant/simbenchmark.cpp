#include "tests/unit/plant/simbenchmark.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace walkman::plant {
namespace {

constexpr double kGravity = ContactWorld::kGravity;

Surface surface(double friction) {
  Surface out;
  out.friction = friction;
  return out;
}

void add_floor(ContactWorld& world, double friction) {
  world.add_fixed(BoxShape{{200, 200, 1}}, at(0, 0, -0.5), surface(friction));
}

}  // namespace

RollingBalls::Accelerations RollingBalls::accelerations() const {
  const double left = force - kFloorFriction * (kBoxMass + kBalls * kBallMass) * kGravity;
  if (left <= 0) return {};
  const double box = left / (kBoxMass + kBalls * kBallMass / 3.5);
  const double most = kBallFriction * kGravity;
  if (box / 3.5 <= most) return {box, box / 3.5};
  return {(left - kBalls * kBallMass * most) / kBoxMass, most};
}

Eigen::Vector3d RollingBalls::p_WBall(int index) {
  const double first = -kSpacing * (kPerSide - 1) / 2;
  const int row = index / kPerSide;
  const int column = index % kPerSide;
  return {first + kSpacing * row, first + kSpacing * column,
          kBoxHeight + kBallRadius - 3 * kFirstPenetration};
}

Eigen::Vector3d RollingBalls::force_W() const { return force * Eigen::Vector3d(1, 1, 0).normalized(); }

void RollingBalls::build(ContactWorld& world) const {
  // A pair has the product of both coefficients.
  add_floor(world, 0.5);
  world.add(BoxShape{{kBoxSide, kBoxSide, kBoxHeight}}, kBoxMass,
            at(0, 0, kBoxHeight / 2 - kFirstPenetration), surface(kFloorFriction / 0.5));
  for (int i = 0; i < kBalls; ++i) {
    world.add(SphereShape{kBallRadius}, kBallMass, Eigen::Isometry3d(Eigen::Translation3d(p_WBall(i))),
              surface(kBallFriction / (kFloorFriction / 0.5)));
  }
}

std::vector<Eigen::Vector3d> BallCube::centres(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto off = [&random] { return kPerturbation * static_cast<double>(random() >> 11) * 0x1p-53; };
  std::vector<Eigen::Vector3d> out;
  for (int i = 0; i < kPerSide; ++i) {
    for (int k = 0; k < kPerSide; ++k) {
      for (int l = 0; l < kPerSide; ++l) {
        const double x = off(), y = off(), z = off();
        out.emplace_back(kGap * i + x, kGap * k + y, kGap * l + z + kHeight);
      }
    }
  }
  return out;
}

void BallCube::build(ContactWorld& world, const std::vector<Eigen::Vector3d>& centres) {
  add_floor(world, 0);
  for (const Eigen::Vector3d& p : centres)
    world.add(SphereShape{kRadius}, kMass, Eigen::Isometry3d(Eigen::Translation3d(p)), surface(0));
}

BallCube::Penetration BallCube::penetration(const std::vector<Eigen::Vector3d>& centres) {
  Penetration out;
  const auto add = [&out](double depth) {
    if (depth <= 0) return;
    out.squares += depth * depth;
    out.deepest = std::max(out.deepest, depth);
  };
  for (std::size_t i = 0; i < centres.size(); ++i) {
    add(kRadius - centres[i].z());
    for (std::size_t k = i + 1; k < centres.size(); ++k) add(2 * kRadius - (centres[i] - centres[k]).norm());
  }
  return out;
}

}  // namespace walkman::plant
