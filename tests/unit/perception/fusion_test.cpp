// Two views of a corner, the second slightly displaced, and of a bar of which half is visible.

#include "adaptation/perception/fusion.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "adaptation/perception/volume.h"

namespace walkman::perception {
namespace {

/// Three walls x, y and z = 0 of 20 cm with 1 mm of noise.
std::vector<Eigen::Vector3f> corner(unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<float> along(0, 0.2F);
  std::normal_distribution<float> noise(0, 0.001F);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 6000; ++i) {
    Eigen::Vector3f p(along(generator), along(generator), along(generator));
    p[i % 3] = noise(generator);
    points.push_back(p);
  }
  return points;
}

/// Nothing lies below it.
Plane floor_far_below() {
  Plane plane;
  plane.offset = 10;
  return plane;
}

double off_the_walls(const std::vector<Eigen::Vector3f>& points) {
  double sum = 0;
  for (const Eigen::Vector3f& p : points) sum += std::pow(static_cast<double>(p.cwiseAbs().minCoeff()), 2);
  return std::sqrt(sum / static_cast<double>(points.size()));
}

TEST(Fusion, BringsAViewThatKinematicsHasAMissOntoTheFirst) {
  const Eigen::AlignedBox3f region(Eigen::Vector3f::Constant(-0.05F), Eigen::Vector3f::Constant(0.25F));
  Eigen::Isometry3d off = Eigen::Isometry3d::Identity();
  off.rotate(Eigen::AngleAxisd(0.01, Eigen::Vector3d(1, 2, 2).normalized()));
  off.translation() = Eigen::Vector3d(0.008, -0.006, 0.007);
  Fusion fusion(corner(1), region, floor_far_below(), 0.005);
  EXPECT_TRUE(fusion.points().empty());
  ASSERT_TRUE(fusion.add(corner(2), off));
  EXPECT_GT(fusion.points().size(), 1000U);
  EXPECT_LT(off_the_walls(fusion.points()), 0.0015);
}

/// A box of 8 cm on a table, of which it covers a fiftieth.
std::vector<Eigen::Vector3f> box_on_table(unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<float> along(-0.28F, 0.28F), beside(-0.04F, 0.04F), up(0, 0.08F);
  std::normal_distribution<float> noise(0, 0.001F);
  std::vector<Eigen::Vector3f> points;
  constexpr std::size_t kOfTable = 30000, kOfSide = 800;
  points.reserve(kOfTable + 3 * kOfSide);
  for (std::size_t i = 0; i < kOfTable; ++i)
    points.emplace_back(along(generator), along(generator), noise(generator));
  for (std::size_t i = 0; i < kOfSide; ++i) {
    points.emplace_back(beside(generator), -0.04F + noise(generator), up(generator));
    points.emplace_back(-0.04F + noise(generator), beside(generator), up(generator));
    points.emplace_back(beside(generator), beside(generator), 0.08F + noise(generator));
  }
  return points;
}

TEST(Fusion, IsNotMisledByTheManyPointsOfThePlane) {
  const Eigen::AlignedBox3f region(Eigen::Vector3f::Constant(-0.3F), Eigen::Vector3f::Constant(0.3F));
  const Eigen::Isometry3d off(Eigen::Translation3d(0.012, 0.01, 0.002));
  Fusion fusion(box_on_table(1), region, Plane(), 0.005);
  ASSERT_TRUE(fusion.add(box_on_table(2), off));
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : fusion.points())
    if (p.z() > 0.02F) box.extend(p);
  EXPECT_NEAR(box.center().x(), 0, 0.003);
  EXPECT_NEAR(box.center().y(), 0, 0.003);
  EXPECT_NEAR(box.max().z(), 0.08, 0.003);
}

TEST(Fusion, LeavesOutWhatDoesNotLieOnTheFirst) {
  const Eigen::AlignedBox3f region(Eigen::Vector3f::Constant(-0.5F), Eigen::Vector3f::Constant(0.5F));
  Fusion fusion(corner(1), region, floor_far_below(), 0.005);
  EXPECT_FALSE(fusion.add(corner(2), Eigen::Isometry3d(Eigen::Translation3d(0.2, 0.2, 0.2))));
  EXPECT_FALSE(fusion.add({}, Eigen::Isometry3d::Identity()));
  EXPECT_TRUE(fusion.points().empty());
}

constexpr double kRadius = 0.035, kLength = 0.6;  // m, of a bar along x
constexpr double kCell = 0.01, kUnseen = 0.02;    // m; anything lower is not distinguished from the table

/// Calls `each` at positions from `from` to `to`, both included, in steps of about `step`.
template <typename Each>
void sweep(double from, double to, double step, const Each& each) {
  const int count = static_cast<int>(std::lround((to - from) / step));
  for (int i = 0; i <= count; ++i) each(from + (to - from) * i / count);
}

/// The bar on a table seen from above at 45°, in C; `with_box`: a box leans against its near side.
struct Table {
  explicit Table(bool with_box) {
    plane.n_C = up;
    plane.offset = kRadius - up.dot(middle);
    bar.p_CM = middle;
    bar.axis_C = Eigen::Vector3d::UnitX();
    bar.radius = kRadius;
    bar.from = -kLength / 2;
    bar.to = kLength / 2;
    const Eigen::Vector3d along = Eigen::Vector3d::UnitX();
    sweep(-kLength / 2, kLength / 2, 0.005, [&](double x) {
      sweep(0, 2 * std::numbers::pi, 0.05, [&](double angle) {
        const Eigen::Vector3d n = std::cos(angle) * up + std::sin(angle) * away;
        see(middle + x * along + kRadius * n, n);
      });
    });
    if (with_box) {
      sweep(-0.05, 0.05, 0.005, [&](double x) {
        sweep(-kBox / 2, kBox / 2, 0.005, [&](double t) {
          see(box + x * along + t * away + kRadius * up, up);
          see(box + x * along - kBox / 2 * away + t * kRadius / (kBox / 2) * up, -away);
        });
      });
    }
    sweep(-0.6, 0.6, 0.002, [&](double x) {
      sweep(-0.4, 0.4, 0.002, [&](double t) {
        cloud.points.push_back((middle + x * along + t * away - kRadius * up).cast<float>());
      });
    });
    cloud.width = static_cast<int>(cloud.points.size());
    cloud.height = 1;
  }
  void see(const Eigen::Vector3d& p, const Eigen::Vector3d& n) {
    if (n.dot(p) >= 0) return;
    cloud.points.push_back(p.cast<float>());
    if (plane.n_C.dot(p) + plane.offset > kUnseen) surface.push_back(p.cast<float>());
  }

  static constexpr double kBox = 0.08;  // m, away from the sensor
  const Eigen::Vector3d up = Eigen::Vector3d(0, -1, -1).normalized(),
                        away = Eigen::Vector3d(0, -1, 1).normalized();
  const Eigen::Vector3d middle{0, 0.05, 0.9};
  const Eigen::Vector3d box = middle - (kRadius + kBox / 2) * away;
  Plane plane;
  Handle bar;
  std::vector<Eigen::Vector3f> surface;
  camera::OrganizedCloud cloud;
};

TEST(VolumeCentroid, OfABarIsOnItsAxis) {
  const Table table(false);
  const std::vector<Handle> tubes{table.bar};
  const FreeSpace free(table.cloud, 0.002);
  const auto centroid = volume_centroid(table.surface, table.plane, tubes, free, kUnseen, kCell);
  ASSERT_TRUE(centroid);
  EXPECT_LT((*centroid - table.middle).norm(), kCell / 10);
  EXPECT_FALSE(volume_centroid(table.surface, table.plane, {}, free, kUnseen, kCell));
}

TEST(VolumeCentroid, HasNoMirrorImageWhereTheSensorLookedThrough) {
  const Table table(true);
  const std::vector<Handle> tubes{table.bar};
  const auto centroid =
      volume_centroid(table.surface, table.plane, tubes, FreeSpace(table.cloud, 0.002), kUnseen, kCell);
  ASSERT_TRUE(centroid);
  const double of_bar = std::numbers::pi * kRadius * kRadius * kLength,
               of_box = 0.1 * Table::kBox * 2 * kRadius;
  const Eigen::Vector3d expected = (of_bar * table.middle + of_box * table.box) / (of_bar + of_box);
  EXPECT_LT((*centroid - expected).norm(), 0.8 * kCell);
}

TEST(VolumeCentroid, CountsThickAndThinPartsByTheirVolume) {
  Table table(false);
  constexpr double kHead = 0.055, kHeadLength = 0.12;  // m; half its thickness
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), head = table.middle + (kLength + kHeadLength) / 2 * x;
  table.plane.offset = kHead - table.up.dot(table.middle);
  sweep(-kHead, kHead, 0.005, [&](double t) {
    sweep(-kHeadLength / 2, kHeadLength / 2, 0.005, [&](double u) {
      table.see(head + u * x + t * table.away + kHead * table.up, table.up);
      table.see(head + u * x + t * table.up - kHead * table.away, -table.away);
    });
    sweep(-kHead, kHead, 0.005,
          [&](double u) { table.see(head - kHeadLength / 2 * x + t * table.up + u * table.away, -x); });
  });
  const FreeSpace nothing(camera::OrganizedCloud{}, 0.002);
  const auto centroid =
      volume_centroid(table.surface, table.plane, std::vector<Handle>{table.bar}, nothing, kUnseen, kCell);
  ASSERT_TRUE(centroid);
  const double of_bar = std::numbers::pi * kRadius * kRadius * kLength,
               of_head = kHeadLength * 4 * kHead * kHead;
  const Eigen::Vector3d expected = (of_bar * table.middle + of_head * head) / (of_bar + of_head);
  EXPECT_LT((*centroid - expected).norm(), kCell / 4);
}

TEST(FreeSpace, EndsAtWhatIsSeenAndSaysNothingOfWhatIsNot) {
  camera::OrganizedCloud cloud;
  sweep(-0.1, 0.1, 0.001, [&](double x) {
    sweep(-0.1, 0.1, 0.001,
          [&](double y) { cloud.points.emplace_back(static_cast<float>(x), static_cast<float>(y), 1.0F); });
  });
  cloud.points.emplace_back(Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  const FreeSpace free(cloud, 0.001);
  EXPECT_TRUE(free.holds({0, 0, 0.9}, 0.01));
  EXPECT_FALSE(free.holds({0, 0, 0.995}, 0.01));
  EXPECT_FALSE(free.holds({0, 0, 1.5}, 0.01));
  EXPECT_FALSE(free.holds({0.5, 0, 0.9}, 0.01));
  EXPECT_FALSE(free.holds({0, 0, -1}, 0.01));
}

}  // namespace
}  // namespace walkman::perception
