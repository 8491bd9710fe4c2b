#include "adaptation/perception/handle_alignment.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>
#include <span>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "adaptation/perception/cylinder_fit.h"
#include "adaptation/perception/parallel_parts.h"
#include "adaptation/perception/voxels.h"

namespace walkman::perception {
namespace {

constexpr std::size_t kHypotheses = 200;
constexpr std::size_t kMostHandles = 16;
constexpr double kLongEnough = 0.04;      // m, a longer set of shells determines its own direction
constexpr double kOnSurface = 0.012;      // m, samples this close to a handle's surface belong to it
constexpr double kPlaceStep = 0.005;      // m, between the places of a handle
constexpr double kSupport = 0.25;         // share of the usual number of surface points that a place needs
constexpr double kHandleMisfit = 0.003;   // m, deviation of objects from cylinders
constexpr double kMatchSpread = 3;        // standard deviations
constexpr double kSuspectedStep = 0.002;  // m, change of radius worth examining
constexpr double kClearSpread = 5;        // standard deviations of a change of radius
constexpr double kSmallestStep = 0.004;   // m, change of radius that makes two handles
constexpr double kStraight = 0.02;        // rad, between the axes of one object's parts
constexpr double kLeastArc = M_PI / 2;    // rad; a smaller arc could belong to any convex surface
constexpr double kMostDoubt = 0.1;        // deviation of the radius over the radius
constexpr double kCertain = 2;            // standard deviations of the radius

struct Agreement {
  double sine, distance, radius;

  [[nodiscard]] bool operator()(const CylindricalShell& shell, const Eigen::Vector3d& point,
                                const Eigen::Vector3d& axis, double its_radius) const {
    const Eigen::Vector3d w = shell.p_CM - point;
    return axis.cross(shell.axis_C).norm() < sine && (w - axis.dot(w) * axis).norm() < distance &&
           std::abs(shell.radius - its_radius) < radius;
  }
};

Agreement agreement(const StageOneParameters& parameters) {
  return {std::sin(parameters.handle_align_angle), parameters.handle_align_distance,
          parameters.handle_align_radius};
}

using Indices = std::vector<std::uint32_t>;

Indices agreeing(const std::vector<CylindricalShell>& shells, const Indices& among, const Agreement& agrees,
                 const CylindricalShell& with) {
  Indices out;
  std::copy_if(among.begin(), among.end(), std::back_inserter(out),
               [&](std::uint32_t i) { return agrees(shells[i], with.p_CM, with.axis_C, with.radius); });
  return out;
}

// The shell with which most others are collinear, and those others.
Indices largest_set(const std::vector<CylindricalShell>& shells, const Indices& among,
                    const Agreement& agrees, int threads) {
  const std::size_t stride = std::max<std::size_t>(1, among.size() / kHypotheses);
  std::vector<Indices> sets((among.size() + stride - 1) / stride);
  for_ranges(threads, sets.size(), 16, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i)
      sets[i] = agreeing(shells, among, agrees, shells[among[i * stride]]);
  });
  return *std::max_element(sets.begin(), sets.end(),
                           [](const Indices& a, const Indices& b) { return a.size() < b.size(); });
}

Cylinder rough_cylinder(const std::vector<CylindricalShell>& shells, const Indices& set, double reach) {
  Cylinder cylinder;
  const auto count = static_cast<double>(set.size());
  Eigen::Matrix3d directions = Eigen::Matrix3d::Zero(), centres = Eigen::Matrix3d::Zero();
  std::vector<double> radii;
  for (const std::uint32_t i : set) {
    cylinder.p_CA += shells[i].p_CM / count;
    directions += shells[i].axis_C * shells[i].axis_C.transpose();
    radii.push_back(shells[i].radius);
  }
  for (const std::uint32_t i : set) {
    const Eigen::Vector3d w = shells[i].p_CM - cylinder.p_CA;
    centres += w * w.transpose() / count;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> line(centres), mean(directions);
  cylinder.axis_C = std::sqrt(line.eigenvalues()[2]) > kLongEnough ? line.eigenvectors().col(2)
                                                                   : mean.eigenvectors().col(2);
  const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
  std::nth_element(radii.begin(), middle, radii.end());
  cylinder.radius = *middle;
  for (const std::uint32_t i : set) {
    const double along = cylinder.axis_C.dot(shells[i].p_CM - cylinder.p_CA);
    cylinder.from = std::min(cylinder.from, along - reach);
    cylinder.to = std::max(cylinder.to, along + reach);
  }
  return cylinder;
}

// Makes the axis point to the right of the camera; if vertical in the image, up.
Eigen::Vector3d to_the_right(const Eigen::Vector3d& axis) {
  const bool flip = std::abs(axis.x()) > 1e-9 ? axis.x() < 0 : axis.y() > 0;
  return flip ? Eigen::Vector3d(-axis) : axis;
}

bool on_surface(const Eigen::Vector3d& p_CP, const Cylinder& cylinder, double reach) {
  const Eigen::Vector3d w = p_CP - cylinder.p_CA;
  const double along = cylinder.axis_C.dot(w);
  return along > cylinder.from - reach && along < cylinder.to + reach &&
         std::abs((w - along * cylinder.axis_C).norm() - cylinder.radius) < kOnSurface;
}

/// A cylinder with its figures from the measured points.
struct Measured {
  Cylinder cylinder;
  CylinderFigures figures;
};

class Aligner {
 public:
  Aligner(const ObjectView& view, const Sampling& sampling, const StageOneParameters& parameters)
      : view_(view),
        sampling_(sampling),
        parameters_(parameters),
        grid_(view.smoothed_C, parameters.handle_neighbourhood / 2) {}

  // Splits the cylinder into parts of one radius each.
  [[nodiscard]] std::vector<Measured> parts(const Cylinder& cylinder) const {
    std::vector<Measured> out;
    const auto figures = cylinder_figures(view_.measured_C, cylinder, sampling_);
    if (!figures) return out;
    if (figures->step && std::abs(figures->step->radius_change) > kSuspectedStep) {
      const auto before = part(cylinder, cylinder.from, figures->step->along, 0),
                 beyond = part(cylinder, figures->step->along, cylinder.to, figures->step->radius_change);
      if (before && beyond) {
        const double change = std::abs(beyond->cylinder.radius - before->cylinder.radius);
        const double doubt = std::hypot(before->figures.radius_deviation, beyond->figures.radius_deviation);
        // A part with another direction is not a neck but a bad fit to a bad end.
        const double turn = before->cylinder.axis_C.cross(beyond->cylinder.axis_C).norm();
        const double most_turn = kStraight + kMatchSpread * std::hypot(before->figures.axis_deviation,
                                                                       beyond->figures.axis_deviation);
        if (change > kSmallestStep && change > kClearSpread * doubt && turn < most_turn) {
          out = parts(before->cylinder);
          for (auto& more : parts(beyond->cylinder)) out.push_back(std::move(more));
          return out;
        }
      }
    }
    out.push_back({cylinder, *figures});
    return out;
  }

  // Returns a handle with the places along the cylinder that have surface and room for a hand; nullopt if
  // there are none.
  [[nodiscard]] std::optional<Handle> handle(const Measured& measured) const {
    const Cylinder& cylinder = measured.cylinder;
    const double reach = parameters_.handle_neighbourhood;
    Handle handle;
    handle.axis_C = to_the_right(cylinder.axis_C);
    handle.radius = cylinder.radius;
    handle.reach = reach;
    const double sense = handle.axis_C.dot(cylinder.axis_C) < 0 ? -1 : 1;
    const std::vector<std::size_t> surface = surface_counts(cylinder);
    std::vector<std::size_t> sorted;
    std::copy_if(surface.begin(), surface.end(), std::back_inserter(sorted),
                 [](std::size_t n) { return n > 0; });
    if (sorted.empty()) return std::nullopt;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    const double enough = kSupport * static_cast<double>(*middle);
    const auto along = [&](std::size_t i) {
      return cylinder.from + (static_cast<double>(i) + 0.5) * kPlaceStep;
    };
    std::vector<char> blocked(surface.size());
    for (std::size_t i = 0; i < surface.size(); ++i) blocked[i] = has_gap(cylinder, along(i)) ? 0 : 1;
    // Neither the ends nor what is in a finger's way are known more precisely than smoothing permits.
    const auto unsure = static_cast<std::size_t>(parameters_.smoothing_voxel / kPlaceStep);
    for (std::size_t i = 0; i < surface.size(); ++i) {
      if (std::min(along(i) - cylinder.from, cylinder.to - along(i)) < parameters_.smoothing_voxel) continue;
      const std::size_t first = i - std::min(i, unsure), last = std::min(i + unsure + 1, surface.size());
      const auto around = std::span(blocked).subspan(first, last - first);
      const bool in_the_way = std::any_of(around.begin(), around.end(), [](char one) { return one != 0; });
      if (static_cast<double>(surface[i]) >= enough && !in_the_way) handle.places.push_back(sense * along(i));
    }
    if (handle.places.empty()) return std::nullopt;
    std::sort(handle.places.begin(), handle.places.end());
    const double supported_from = std::min(sense * cylinder.from, sense * cylinder.to);
    const double supported_to = std::max(sense * cylinder.from, sense * cylinder.to);
    const double from = std::max(supported_from, handle.places.front() - reach);
    const double to = std::min(supported_to, handle.places.back() + reach);
    const double centre = (from + to) / 2;
    handle.p_CM = cylinder.p_CA + centre * handle.axis_C;
    handle.from = from - centre;
    handle.to = to - centre;
    for (double& place : handle.places) place -= centre;
    handle.residual = measured.figures.residual;
    handle.arc = measured.figures.arc;
    handle.radius_deviation = measured.figures.radius_deviation;
    handle.position_deviation = measured.figures.position_deviation;
    handle.axis_deviation = measured.figures.axis_deviation;
    return handle;
  }

 private:
  [[nodiscard]] std::optional<Measured> part(const Cylinder& whole, double from, double to,
                                             double radius_change) const {
    Cylinder initial = whole;
    initial.from = from;
    initial.to = to;
    initial.radius += radius_change;
    if (initial.radius <= 0) return std::nullopt;
    auto refined = best_cylinder(view_, initial, sampling_, parameters_.threads);
    if (!refined) return std::nullopt;
    // The refined part must not extend into the other one.
    const auto along = [&](double place) {
      return refined->axis_C.dot(whole.p_CA + place * whole.axis_C - refined->p_CA);
    };
    refined->from = std::max(refined->from, along(from));
    refined->to = std::min(refined->to, along(to));
    if (refined->to - refined->from < kLongEnough / 2) return std::nullopt;
    const auto figures = cylinder_figures(view_.measured_C, *refined, sampling_);
    if (!figures) return std::nullopt;
    return Measured{*refined, *figures};
  }

  // Counts the measured points on the surface, by steps along the axis.
  [[nodiscard]] std::vector<std::size_t> surface_counts(const Cylinder& cylinder) const {
    const double range = cylinder.p_CA.norm();
    const double tolerance = kHandleMisfit + kMatchSpread * sampling_.deviation(range);
    std::vector<std::size_t> counts(static_cast<std::size_t>((cylinder.to - cylinder.from) / kPlaceStep) + 1,
                                    0);
    for (const auto& point : view_.measured_C) {
      const Eigen::Vector3d w = point.cast<double>() - cylinder.p_CA;
      const double along = cylinder.axis_C.dot(w);
      if (along < cylinder.from || along > cylinder.to ||
          std::abs((w - along * cylinder.axis_C).norm() - cylinder.radius) > tolerance)
        continue;
      ++counts[std::min(counts.size() - 1, static_cast<std::size_t>((along - cylinder.from) / kPlaceStep))];
    }
    return counts;
  }

  [[nodiscard]] bool has_gap(const Cylinder& cylinder, double along) const {
    const double half = parameters_.handle_neighbourhood;
    const double outer = parameters_.handle_max_radius + parameters_.handle_gap;
    const Eigen::Vector3d place = cylinder.p_CA + along * cylinder.axis_C;
    std::vector<std::uint32_t> near;
    grid_.within(place.cast<float>(), std::hypot(half, outer), near);
    std::vector<double> distances;
    for (const std::uint32_t i : near) {
      const Eigen::Vector3d d = view_.smoothed_C[i].cast<double>() - place;
      const double offset = cylinder.axis_C.dot(d);
      if (std::abs(offset) < half) distances.push_back((d - offset * cylinder.axis_C).norm());
    }
    return has_free_gap(distances, cylinder.radius, parameters_);
  }

  const ObjectView& view_;
  const Sampling& sampling_;
  const StageOneParameters& parameters_;
  PointGrid grid_;
};

// Returns whether a hand for the parameters' radii is certain to fit.
bool fits_hand(const Handle& handle, const StageOneParameters& parameters) {
  const double doubt = kCertain * handle.radius_deviation;
  return handle.arc >= kLeastArc && handle.radius_deviation <= kMostDoubt * handle.radius &&
         handle.radius - doubt >= parameters.handle_min_radius &&
         handle.radius + doubt <= parameters.handle_max_radius;
}

void longest_first(std::vector<Handle>& handles) {
  std::stable_sort(handles.begin(), handles.end(),
                   [](const Handle& a, const Handle& b) { return a.places.size() > b.places.size(); });
}

}  // namespace

AlignedHandles align_handles(const std::vector<CylindricalShell>& shells, const ObjectView& view,
                             const Sampling& sampling, const StageOneParameters& parameters) {
  const Agreement agrees = agreement(parameters);
  const double reach = parameters.handle_neighbourhood;
  const auto fewest = static_cast<std::size_t>(parameters.handle_min_inliers);
  const Aligner aligner(view, sampling, parameters);
  AlignedHandles out;
  Indices left(shells.size());
  std::iota(left.begin(), left.end(), 0U);
  while (left.size() >= fewest && out.handles.size() < kMostHandles) {
    const Indices set = largest_set(shells, left, agrees, parameters.threads);
    if (set.size() < fewest) break;
    const auto cylinder =
        best_cylinder(view, rough_cylinder(shells, set, reach), sampling, parameters.threads);
    const std::vector<Measured> parts = cylinder ? aligner.parts(*cylinder) : std::vector<Measured>{};
    for (const Measured& part : parts)
      if (auto handle = aligner.handle(part))
        (fits_hand(*handle, parameters) ? out.handles : out.refused).push_back(std::move(*handle));
    // Shells on the parts are done; the rest of the set may contain another radius of the same object.
    const std::size_t before = left.size();
    std::erase_if(left, [&](std::uint32_t i) {
      return std::any_of(parts.begin(), parts.end(), [&](const Measured& part) {
        return on_surface(shells[i].p_CP, part.cylinder, reach);
      });
    });
    // The set is in ascending order. If too few shells lie on the parts, it is removed whole, so that the
    // search ends.
    if (2 * (before - left.size()) < set.size())
      std::erase_if(left, [&](std::uint32_t i) { return std::binary_search(set.begin(), set.end(), i); });
  }
  longest_first(out.handles);
  longest_first(out.refused);
  return out;
}

}  // namespace walkman::perception
