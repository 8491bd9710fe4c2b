#include "adaptation/perception/cylindrical_shell.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <random>

#include <Eigen/Geometry>

#include "adaptation/perception/cylinder_fit.h"
#include "adaptation/perception/parallel_parts.h"
#include "adaptation/perception/quadric.h"
#include "adaptation/perception/voxels.h"

namespace walkman::perception {
namespace {

constexpr int kPartsPerThread = 16;  // neighbourhoods differ in size: small parts keep all threads busy

constexpr std::size_t kFewestNeighbours = 20;
constexpr std::size_t kCurvatureProbes = 25;  // neighbours whose curvatures are compared
constexpr double kRadiusSlack = 1.5;          // curvature is noisier than the circle fitted afterwards
constexpr double kStraightness = 0.6;         // largest ratio of the smaller to the larger curvature
constexpr double kGapStep = 0.001;            // m
constexpr int kGapPoints = 2;                 // stray points a gap may hold
constexpr int kInsidePoints = 10;             // fewest points inside the gap

class ShellFinder {
 public:
  ShellFinder(const PointGrid& grid, const StageOneParameters& parameters)
      : grid_(grid), parameters_(parameters) {}

  std::optional<CylindricalShell> at(const Eigen::Vector3f& sample) {
    grid_.within(sample, parameters_.handle_neighbourhood, near_);
    if (near_.size() < kFewestNeighbours) return std::nullopt;
    const auto quadric = fit_quadric(grid_.points(), near_);
    if (!quadric) return std::nullopt;
    const auto curvature = typical_curvature(*quadric);
    if (!curvature || curvature->largest <= 0) return std::nullopt;
    const double bend = 1 / curvature->largest;
    if (bend < parameters_.handle_min_radius / kRadiusSlack ||
        bend > parameters_.handle_max_radius * kRadiusSlack ||
        std::abs(curvature->smallest) > kStraightness * curvature->largest)
      return std::nullopt;
    auto shell = fit_cylinder(*curvature);
    if (!shell || !has_gap(*shell)) return std::nullopt;
    shell->p_CP = sample.cast<double>();
    return shell;
  }

 private:
  // Curvatures of the probe whose larger curvature is the median.
  std::optional<PrincipalCurvatures> typical_curvature(const Quadric& quadric) {
    probes_.clear();
    const std::size_t stride = std::max<std::size_t>(1, near_.size() / kCurvatureProbes);
    for (std::size_t i = 0; i < near_.size(); i += stride)
      if (const auto k = principal_curvatures(quadric, grid_.points()[near_[i]].cast<double>()))
        probes_.push_back(*k);
    if (probes_.empty()) return std::nullopt;
    const auto middle = probes_.begin() + static_cast<std::ptrdiff_t>(probes_.size() / 2);
    std::nth_element(probes_.begin(), middle, probes_.end(),
                     [](const auto& a, const auto& b) { return a.largest < b.largest; });
    return *middle;
  }

  std::optional<CylindricalShell> fit_cylinder(const PrincipalCurvatures& curvature) {
    const Eigen::Vector3d axis = curvature.along_smallest_C.normalized();
    const Eigen::Vector3d across = axis.cross(curvature.n_C);
    const Eigen::Vector3d origin = grid_.points()[near_.front()].cast<double>();
    section_.clear();
    double along = 0;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const std::uint32_t i : near_) {
      const Eigen::Vector3d d = grid_.points()[i].cast<double>() - origin;
      section_.emplace_back(curvature.n_C.dot(d), across.dot(d));
      along += axis.dot(d);
      mean += d;
    }
    const auto circle = fit_circle(section_);
    if (!circle || circle->radius < parameters_.handle_min_radius ||
        circle->radius > parameters_.handle_max_radius)
      return std::nullopt;
    const auto count = static_cast<double>(near_.size());
    CylindricalShell shell;
    shell.axis_C = axis;
    shell.radius = circle->radius;
    shell.p_CM =
        origin + circle->centre.x() * curvature.n_C + circle->centre.y() * across + along / count * axis;
    // The material must lie behind the surface.
    const Eigen::Vector3d outward = origin + mean / count - shell.p_CM;
    if (outward.dot(curvature.n_C) <= 0) return std::nullopt;
    return shell;
  }

  bool has_gap(const CylindricalShell& shell) {
    const double half = parameters_.handle_neighbourhood;
    const double outer = parameters_.handle_max_radius + parameters_.handle_gap;
    grid_.within(shell.p_CM.cast<float>(), std::hypot(half, outer), near_);
    distances_.clear();
    for (const std::uint32_t i : near_) {
      const Eigen::Vector3d d = grid_.points()[i].cast<double>() - shell.p_CM;
      const double along = shell.axis_C.dot(d);
      if (std::abs(along) < half) distances_.push_back((d - along * shell.axis_C).norm());
    }
    return has_free_gap(distances_, shell.radius, parameters_);
  }

  const PointGrid& grid_;
  const StageOneParameters& parameters_;
  std::vector<std::uint32_t> near_;
  std::vector<PrincipalCurvatures> probes_;
  std::vector<Eigen::Vector2d> section_;
  std::vector<double> distances_;
};

// `wanted` distinct indices, or all if there are fewer, in random order.
std::vector<std::uint32_t> draw(std::size_t count, std::size_t wanted, std::uint64_t seed) {
  std::vector<std::uint32_t> indices(count);
  std::iota(indices.begin(), indices.end(), 0U);
  // Does not use the distributions of <random>, which differ between standard libraries.
  std::mt19937_64 generator(seed);
  wanted = std::min(wanted, count);
  for (std::size_t i = 0; i < wanted; ++i) std::swap(indices[i], indices[i + generator() % (count - i)]);
  indices.resize(wanted);
  return indices;
}

}  // namespace

bool has_free_gap(std::span<const double> distances, double radius, const StageOneParameters& parameters) {
  // Number of points up to each step from the surface to the far side of the last possible gap.
  const int steps = static_cast<int>((parameters.handle_max_radius - radius) / kGapStep);
  const int gap = std::max(1, static_cast<int>(std::lround(parameters.handle_gap / kGapStep)));
  if (steps < 0) return false;
  std::vector<int> within(static_cast<std::size_t>(steps + gap) + 1, 0);
  for (const double distance : distances) {
    const double step = std::max(0.0, std::ceil((distance - radius) / kGapStep));
    if (step < static_cast<double>(within.size())) ++within[static_cast<std::size_t>(step)];
  }
  std::partial_sum(within.begin(), within.end(), within.begin());
  // The gap may begin anywhere between the surface and the hand's opening, because noisy points protrude from
  // the surface.
  for (std::size_t step = 0; step <= static_cast<std::size_t>(steps); ++step)
    if (within[step] >= kInsidePoints &&
        within[step + static_cast<std::size_t>(gap)] - within[step] <= kGapPoints)
      return true;
  return false;
}

std::vector<CylindricalShell> find_shells(std::span<const Eigen::Vector3f> object_C,
                                          const StageOneParameters& parameters) {
  if (object_C.empty()) return {};
  const PointGrid grid(object_C, parameters.handle_neighbourhood / 2);
  const auto samples =
      draw(object_C.size(), static_cast<std::size_t>(parameters.handle_samples), parameters.seed);
  std::vector<std::optional<CylindricalShell>> found(samples.size());
  const int parts = kPartsPerThread * std::max(1, parameters.threads);
  for_parts(parameters.threads, parts, [&](int part) {
    const auto first = [&](int number) {
      return samples.size() * static_cast<std::size_t>(number) / static_cast<std::size_t>(parts);
    };
    ShellFinder finder(grid, parameters);
    for (std::size_t i = first(part); i < first(part + 1); ++i) found[i] = finder.at(object_C[samples[i]]);
  });
  std::vector<CylindricalShell> shells;
  for (const auto& shell : found)
    if (shell) shells.push_back(*shell);
  return shells;
}

}  // namespace walkman::perception
