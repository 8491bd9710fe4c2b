#include "adaptation/perception/handle_alignment.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "adaptation/perception/cylinder_fit.h"

namespace walkman::perception {
namespace {

constexpr std::size_t kHypotheses = 200;
constexpr std::size_t kMostHandles = 16;
constexpr double kLongEnough = 0.04;  // m, a set of shells longer than this tells its own direction
constexpr double kOnSurface = 0.012;  // m, samples this near a handle's surface belong to it

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
                 const Eigen::Vector3d& point, const Eigen::Vector3d& axis, double radius) {
  Indices out;
  std::copy_if(among.begin(), among.end(), std::back_inserter(out),
               [&](std::uint32_t i) { return agrees(shells[i], point, axis, radius); });
  return out;
}

// The shell most others are co-linear with, and those.
Indices largest_set(const std::vector<CylindricalShell>& shells, const Indices& among,
                    const Agreement& agrees) {
  const std::size_t stride = std::max<std::size_t>(1, among.size() / kHypotheses);
  Indices best;
  for (std::size_t i = 0; i < among.size(); i += stride) {
    const CylindricalShell& h = shells[among[i]];
    Indices set = agreeing(shells, among, agrees, h.p_CM, h.axis_C, h.radius);
    if (set.size() > best.size()) best = std::move(set);
  }
  return best;
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

// The shells that agree with the cylinder, none far beyond its ends.
Indices on_cylinder(const std::vector<CylindricalShell>& shells, const Indices& among,
                    const Agreement& agrees, const Cylinder& cylinder, double reach) {
  Indices members = agreeing(shells, among, agrees, cylinder.p_CA, cylinder.axis_C, cylinder.radius);
  std::erase_if(members, [&](std::uint32_t i) {
    const double along = cylinder.axis_C.dot(shells[i].p_CM - cylinder.p_CA);
    return along < cylinder.from - reach || along > cylinder.to + reach;
  });
  return members;
}

// The axis points to the right of the camera; across the image, up.
Eigen::Vector3d to_the_right(const Eigen::Vector3d& axis) {
  const bool flip = std::abs(axis.x()) > 1e-9 ? axis.x() < 0 : axis.y() > 0;
  return flip ? Eigen::Vector3d(-axis) : axis;
}

Handle make_handle(const Cylinder& cylinder, const std::vector<CylindricalShell>& shells, const Indices& set,
                   double reach) {
  Handle handle;
  handle.axis_C = to_the_right(cylinder.axis_C);
  handle.radius = cylinder.radius;
  handle.reach = reach;
  const bool flipped = handle.axis_C.dot(cylinder.axis_C) < 0;
  const double supported_from = flipped ? -cylinder.to : cylinder.from;
  const double supported_to = flipped ? -cylinder.from : cylinder.to;
  for (const std::uint32_t i : set)
    handle.places.push_back(
        std::clamp(handle.axis_C.dot(shells[i].p_CM - cylinder.p_CA), supported_from, supported_to));
  std::sort(handle.places.begin(), handle.places.end());
  const double from = std::max(supported_from, handle.places.front() - reach);
  const double to = std::min(supported_to, handle.places.back() + reach);
  const double middle = (from + to) / 2;
  handle.p_CM = cylinder.p_CA + middle * handle.axis_C;
  handle.from = from - middle;
  handle.to = to - middle;
  for (double& place : handle.places) place -= middle;
  return handle;
}

bool on_surface(const CylindricalShell& shell, const Handle& handle, double reach) {
  const Eigen::Vector3d w = shell.p_CP - handle.p_CM;
  const double along = handle.axis_C.dot(w);
  return along > handle.from - reach && along < handle.to + reach &&
         std::abs((w - along * handle.axis_C).norm() - handle.radius) < kOnSurface;
}

}  // namespace

std::vector<Handle> align_handles(const std::vector<CylindricalShell>& shells,
                                  std::span<const Eigen::Vector3f> measured_C,
                                  const StageOneParameters& parameters) {
  const Agreement agrees = agreement(parameters);
  const double reach = parameters.handle_neighbourhood;
  const auto fewest = static_cast<std::size_t>(parameters.handle_min_inliers);
  std::vector<Handle> handles;
  Indices left(shells.size());
  std::iota(left.begin(), left.end(), 0U);
  while (left.size() >= fewest && handles.size() < kMostHandles) {
    const Indices set = largest_set(shells, left, agrees);
    if (set.size() < fewest) break;
    const auto refined = refine_cylinder(measured_C, rough_cylinder(shells, set, reach));
    const Indices members = refined ? on_cylinder(shells, left, agrees, *refined, reach) : Indices{};
    std::optional<Handle> handle;
    if (members.size() >= fewest && refined->radius >= parameters.handle_min_radius &&
        refined->radius <= parameters.handle_max_radius)
      handle = make_handle(*refined, shells, members, reach);
    // All three index lists ascend. Without a handle the set itself goes, so that the search ends.
    std::erase_if(left, [&](std::uint32_t i) {
      return std::binary_search(set.begin(), set.end(), i) ||
             (handle && (on_surface(shells[i], *handle, reach) ||
                         std::binary_search(members.begin(), members.end(), i)));
    });
    if (handle) handles.push_back(std::move(*handle));
  }
  std::stable_sort(handles.begin(), handles.end(),
                   [](const Handle& a, const Handle& b) { return a.places.size() > b.places.size(); });
  return handles;
}

}  // namespace walkman::perception
