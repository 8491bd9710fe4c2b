#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "adaptation/motion/body_shape.h"
#include "adaptation/perception/stage_one.h"
#include "emulator/plant/dynamics/world_objects.h"
#include "sensors/stereo_camera.h"
#include "tests/unit/experiment/first_look.h"
#include "urdf/reader/kinematics.h"

namespace walkman::apps {
namespace {

constexpr double kCentimetre = 0.01;
constexpr double kAxisError = 3 * std::numbers::pi / 180, kRadiusError = 0.003;  // m
constexpr double kAround = 0.005;    // m outside of a tube, where fingers go
constexpr double kImageBorder = 20;  // pixels
constexpr double kHalfPalm = 0.055;  // m, of the paper's hand
constexpr int kSides = 24, kPalmSteps = 11;

/// A centimetre of a tube's axis.
struct Piece {
  Eigen::Vector3d p_C, axis_C;
  double radius;
  bool holds;         // of the hand's size, and nothing else of the object where fingers go round it
  bool takes_a_hand;  // the same over the breadth of a palm
  bool seen;          // its top is in the image
};

struct Scored {
  int graspable = 0, found = 0;
  int wrong = 0;  // places of handles where no finger can go round
  double worst_axis = 0, worst_radius = 0;
};

std::vector<Piece> pieces_of(const RobotModel& object, const Eigen::Isometry3d& X_CO,
                             const StageOneParameters& parameters) {
  const sensors::StereoOptions camera;
  const std::vector<Eigen::Isometry3d> X_OL = link_poses(object, {});
  const std::vector<motion::BodyShape> shapes = motion::body_shapes(object);
  const auto X_CS = [&](const motion::BodyShape& shape) -> Eigen::Isometry3d {
    return X_CO * X_OL[static_cast<std::size_t>(shape.link)] * shape.X_LS;
  };
  std::vector<Piece> pieces;
  for (const motion::BodyShape& tube : shapes) {
    if (!tube.cylinder) continue;
    const Eigen::Isometry3d X_CT = X_CS(tube);
    const double radius = tube.half.x();
    const bool fits = radius >= parameters.handle_min_radius && radius <= parameters.handle_max_radius;
    const auto beside = [&](double z, int side) -> Eigen::Vector3d {
      const double angle = 2 * std::numbers::pi * side / kSides;
      return X_CT *
             Eigen::Vector3d((radius + kAround) * std::cos(angle), (radius + kAround) * std::sin(angle), z);
    };
    const auto free = [&](double z) {
      for (int side = 0; side < kSides; ++side) {
        for (const motion::BodyShape& other : shapes) {
          if (&other == &tube) continue;
          const Eigen::Vector3d p_S = X_CS(other).inverse() * beside(z, side);
          if ((p_S - other.nearest_S(p_S)).norm() <= other.rounding) return false;
        }
      }
      return true;
    };
    const int count = static_cast<int>(2 * tube.half.z() / kCentimetre);
    for (int i = 0; i < count; ++i) {
      const double z = -tube.half.z() + (i + 0.5) * kCentimetre;
      Eigen::Vector3d top_C = beside(z, 0);
      for (int side = 1; side < kSides; ++side)
        if (beside(z, side).norm() < top_C.norm()) top_C = beside(z, side);
      const double u = camera.focal_px * top_C.x() / top_C.z() + camera.cx,
                   v = camera.focal_px * top_C.y() / top_C.z() + camera.cy;
      bool whole_palm = fits;
      for (int step = -kPalmSteps; step <= kPalmSteps; ++step)
        whole_palm = whole_palm && free(z + kHalfPalm * step / kPalmSteps);
      pieces.push_back({X_CT * Eigen::Vector3d(0, 0, z), X_CT.linear().col(2), radius, fits && free(z),
                        whole_palm,
                        u > kImageBorder && u < camera.width - kImageBorder && v > kImageBorder &&
                            v < camera.height - kImageBorder});
    }
  }
  return pieces;
}

Scored scored(const std::vector<Piece>& pieces, const std::vector<perception::Handle>& handles) {
  Scored out;
  const auto on_axis = [](const perception::Handle& handle, const Piece& piece) {
    const Eigen::Vector3d from_middle = piece.p_C - handle.p_CM;
    const double along = handle.axis_C.dot(from_middle);
    return (from_middle - along * handle.axis_C).norm() < piece.radius
               ? along
               : std::numeric_limits<double>::infinity();
  };
  for (const Piece& piece : pieces) {
    if (!piece.takes_a_hand || !piece.seen) continue;
    ++out.graspable;
    out.found += std::any_of(handles.begin(), handles.end(), [&](const perception::Handle& handle) {
      const double along = on_axis(handle, piece);
      return std::isfinite(along) && std::abs(handle.nearest_graspable(along) - along) <= kCentimetre;
    });
  }
  for (const perception::Handle& handle : handles) {
    for (const double place : handle.places) {
      const Eigen::Vector3d p_C = handle.p_CM + place * handle.axis_C;
      const auto nearest =
          std::min_element(pieces.begin(), pieces.end(), [&](const Piece& a, const Piece& b) {
            // A place is on the tube that it lies in; where that is covered, on what covers it.
            const auto off = [&](const Piece& piece) {
              return (piece.p_C - p_C).norm() + (piece.holds ? 0 : kCentimetre);
            };
            return off(a) < off(b);
          });
      if (!nearest->holds) {
        ++out.wrong;
        continue;
      }
      out.worst_axis =
          std::max(out.worst_axis, std::acos(std::min(1.0, std::abs(nearest->axis_C.dot(handle.axis_C)))));
      out.worst_radius = std::max(out.worst_radius, std::abs(handle.radius - nearest->radius));
    }
  }
  return out;
}

/// Of a scene, by the noisy camera of a robot that is not quite its model.
Scored look(int experiment, std::uint64_t seed) {
  const FirstLook first(experiment, seed);
  const auto pieces =
      pieces_of(plant::with_weights(first.world.scene.objects.front()), first.X_CO, first.parameters);
  const auto seen = perception::locate(first.cloud, first.parameters, first.X_CO.translation());
  return scored(pieces, seen.object().handles);
}

class HandleRecall : public testing::TestWithParam<int> {};

TEST_P(HandleRecall, OfWhatCanBeGraspedAndNothingElse) {
  int graspable = 0, found = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Scored s = look(GetParam(), seed);
    SCOPED_TRACE(::testing::Message()
                 << "seed " << seed << ": " << s.found << " of " << s.graspable << " cm");
    EXPECT_GT(s.graspable, 0);
    // Of fewer centimetres one is more than a twentieth.
    if (s.graspable >= 20) {
      EXPECT_GE(s.found, 0.95 * s.graspable);
    }
    EXPECT_EQ(s.wrong, 0);
    EXPECT_LE(s.worst_axis, kAxisError);
    EXPECT_LE(s.worst_radius, kRadiusError);
    graspable += s.graspable;
    found += s.found;
  }
  EXPECT_GE(found, 0.95 * graspable) << found << " of " << graspable << " cm";
}

INSTANTIATE_TEST_SUITE_P(Experiments, HandleRecall, testing::Range(1, 12));

/// What each filter does to the handles and to the visual centre of mass. docs/architecture.md has the table.
TEST(FilterSteps, KeepHandlesFromBeingMissed) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "measures for minutes what HandleRecall has run";
#endif
  struct Setting {
    const char* name;
    bool removes, smooths;
    Scored sum{};
    double centre = 0, farthest = 0;  // m, by which the visual centre of mass is another: mean and most
  };
  Setting settings[] = {{"both", true, true},
                        {"no outlier removal", false, true},
                        {"no smoothing", true, false},
                        {"neither", false, false}};
  constexpr int kExperiments = 11;
  constexpr std::uint64_t kSeeds = 3;
  for (int look = 0; look < kExperiments * static_cast<int>(kSeeds); ++look) {
    FirstLook first(1 + look % kExperiments, 1 + static_cast<std::uint64_t>(look / kExperiments));
    const auto pieces =
        pieces_of(plant::with_weights(first.world.scene.objects.front()), first.X_CO, first.parameters);
    Eigen::Vector3d with_both = Eigen::Vector3d::Zero();
    for (Setting& setting : settings) {
      StageOneParameters parameters = first.parameters;
      if (!setting.removes) parameters.outlier_neighbours = 0;
      if (!setting.smooths) parameters.smoothing_radius = 0;
      const auto seen = perception::locate(first.cloud, parameters, first.X_CO.translation());
      const Scored s = scored(pieces, seen.object().handles);
      Scored& sum = setting.sum;
      sum.graspable += s.graspable;
      sum.found += s.found;
      sum.wrong += s.wrong;
      sum.worst_axis = std::max(sum.worst_axis, s.worst_axis);
      sum.worst_radius = std::max(sum.worst_radius, s.worst_radius);
      if (&setting == settings) with_both = seen.object().p_CCm;
      const double moved = (seen.object().p_CCm - with_both).norm();
      setting.centre += moved / (kExperiments * static_cast<double>(kSeeds));
      setting.farthest = std::max(setting.farthest, moved);
    }
  }
  std::printf("%-20s %14s %12s %10s %11s %24s\n", "filters", "found, cm", "wrong places", "axis, deg",
              "radius, mm", "centre moved, mm (most)");
  for (const Setting& s : settings) {
    std::printf("%-20s %5d of %5d %12d %10.1f %11.1f %16.1f (%5.1f)\n", s.name, s.sum.found, s.sum.graspable,
                s.sum.wrong, s.sum.worst_axis * 180 / std::numbers::pi, s.sum.worst_radius * 1e3,
                s.centre * 1e3, s.farthest * 1e3);
  }
  EXPECT_GE(settings[0].sum.found, 0.95 * settings[0].sum.graspable);
  EXPECT_LT(settings[2].sum.found, settings[0].sum.found);
  EXPECT_LT(settings[3].sum.found, settings[2].sum.found);
}

}  // namespace
}  // namespace walkman::apps
