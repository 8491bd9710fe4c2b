#include "adaptation/perception/handle_shell.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include <Eigen/Geometry>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include "adaptation/perception/cylinder_fit.h"
#include "adaptation/perception/point_grid.h"
#include "adaptation/perception/quadric.h"
#include "adaptation/perception/random_source.h"

namespace walkman::perception {
namespace {

constexpr std::size_t kFewestNeighbours = 20;
constexpr std::size_t kCurvatureProbes = 25;  // neighbours whose curvatures are compared
constexpr double kRadiusSlack = 1.5;   // curvature is noisier than the circle that is fitted afterwards
constexpr double kStraightness = 0.6;  // largest ratio of the smaller to the larger curvature
constexpr double kGapStep = 0.001;     // m
constexpr int kGapPoints = 2;          // stray points a gap may hold
constexpr int kInsidePoints = 10;

class ShellFinder {
 public:
  ShellFinder(const PointGrid& grid, const StageOneParameters& parameters)
      : grid_(grid), parameters_(parameters) {}

  std::optional<Shell> at(const Eigen::Vector3f& sample) {
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
    shell->sample = sample.cast<double>();
    return shell;
  }

 private:
  // The curvatures whose larger one is the median among the probes.
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

  std::optional<Shell> fit_cylinder(const PrincipalCurvatures& curvature) {
    const Eigen::Vector3d axis = curvature.along_smallest.normalized();
    const Eigen::Vector3d across = axis.cross(curvature.normal);
    const Eigen::Vector3d origin = grid_.points()[near_.front()].cast<double>();
    section_.clear();
    double along = 0;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const std::uint32_t i : near_) {
      const Eigen::Vector3d d = grid_.points()[i].cast<double>() - origin;
      section_.emplace_back(curvature.normal.dot(d), across.dot(d));
      along += axis.dot(d);
      mean += d;
    }
    const auto circle = fit_circle(section_);
    if (!circle || circle->radius < parameters_.handle_min_radius ||
        circle->radius > parameters_.handle_max_radius)
      return std::nullopt;
    const auto count = static_cast<double>(near_.size());
    Shell shell;
    shell.axis = axis;
    shell.radius = circle->radius;
    shell.centre =
        origin + circle->centre.x() * curvature.normal + circle->centre.y() * across + along / count * axis;
    // The material must be behind its surface.
    const Eigen::Vector3d outward = origin + mean / count - shell.centre;
    if (outward.dot(curvature.normal) <= 0) return std::nullopt;
    return shell;
  }

  bool has_gap(const Shell& shell) {
    const double half = parameters_.handle_neighbourhood;
    const double outer = parameters_.handle_max_radius + parameters_.handle_gap;
    grid_.within(shell.centre.cast<float>(), std::hypot(half, outer), near_);
    distances_.clear();
    for (const std::uint32_t i : near_) {
      const Eigen::Vector3d d = grid_.points()[i].cast<double>() - shell.centre;
      const double along = shell.axis.dot(d);
      if (std::abs(along) < half) distances_.push_back((d - along * shell.axis).norm());
    }
    // The gap may begin anywhere between the surface and the hand's opening: noisy points stand out from the
    // surface.
    const int steps = static_cast<int>((parameters_.handle_max_radius - shell.radius) / kGapStep);
    for (int step = 0; step <= steps; ++step) {
      const double start = shell.radius + step * kGapStep;
      int inside = 0, between = 0;
      for (const double distance : distances_) {
        inside += distance <= start ? 1 : 0;
        between += distance > start && distance < start + parameters_.handle_gap ? 1 : 0;
      }
      if (between <= kGapPoints && inside >= kInsidePoints) return true;
    }
    return false;
  }

  const PointGrid& grid_;
  const StageOneParameters& parameters_;
  std::vector<std::uint32_t> near_;
  std::vector<PrincipalCurvatures> probes_;
  std::vector<Eigen::Vector2d> section_;
  std::vector<double> distances_;
};

// `wanted` different indices, or all when there are fewer; in random order.
std::vector<std::uint32_t> draw(std::size_t count, std::size_t wanted, std::uint64_t seed) {
  std::vector<std::uint32_t> indices(count);
  std::iota(indices.begin(), indices.end(), 0U);
  RandomSource random(seed);
  wanted = std::min(wanted, count);
  for (std::size_t i = 0; i < wanted; ++i) std::swap(indices[i], indices[i + random.index(count - i)]);
  indices.resize(wanted);
  return indices;
}

}  // namespace

std::vector<Shell> find_shells(std::span<const Eigen::Vector3f> object,
                               const StageOneParameters& parameters) {
  if (object.empty()) return {};
  const PointGrid grid(object, parameters.handle_neighbourhood / 2);
  const auto samples =
      draw(object.size(), static_cast<std::size_t>(parameters.handle_samples), parameters.seed);
  std::vector<std::optional<Shell>> found(samples.size());
  tbb::task_arena arena(std::clamp(parameters.threads, 1, tbb::info::default_concurrency()));
  arena.execute([&] {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, samples.size()), [&](const auto& range) {
      ShellFinder finder(grid, parameters);
      for (std::size_t i = range.begin(); i < range.end(); ++i) found[i] = finder.at(object[samples[i]]);
    });
  });
  std::vector<Shell> shells;
  for (const auto& shell : found)
    if (shell) shells.push_back(*shell);
  return shells;
}

}  // namespace walkman::perception
