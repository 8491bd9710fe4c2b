#include "adaptation/perception/cylinder_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Geometry>

namespace walkman::perception {
namespace {

constexpr std::array kStarts{1.0, 0.65, 0.4, 0.25};  // fractions of the rough radius
constexpr double kMostSeenThrough = 1.0 / 3;
constexpr double kWindow = 6;  // px beside a rim where a matching window may report the object's range
constexpr double kLeastWindow = 0.004;  // m, lower bound of the same
constexpr double kWorst = 9;            // cost of a contradicting ray: three standard deviations, squared
constexpr double kSame = 1e-4;          // m, of the radius: closer fits have converged to the same cylinder
constexpr double kCylinderMisfit = 0.001;  // m, deviation of objects from cylinders

// Distance of the infinite line along `direction_C` from the axis, and where on the axis it is nearest.
struct Pass {
  double distance, along;
};
Pass pass(const Eigen::Vector3d& direction_C, const Cylinder& cylinder) {
  const Eigen::Vector3d& a = cylinder.axis_C;
  const double cosine = direction_C.dot(a), square = 1 - cosine * cosine;
  const double p = cylinder.p_CA.dot(direction_C), q = cylinder.p_CA.dot(a);
  const double along = square < 1e-9 ? 0 : (p * cosine - q) / square;
  const Eigen::Vector3d nearest = cylinder.p_CA + along * a;
  return {(nearest - nearest.dot(direction_C) * direction_C).norm(), along};
}

// How well the rays around the object agree with a cylinder.
struct Verdict {
  double cost = 0;
  std::size_t met = 0, passed = 0;

  [[nodiscard]] double seen_through() const {
    return met + passed == 0 ? 1 : static_cast<double>(passed) / static_cast<double>(met + passed);
  }
};

/// Compares cylinders near `rough` over one set of rays: those that pass within `widest` m of its axis.
class RayComparison {
 public:
  RayComparison(const ObjectView& view, const Cylinder& rough, double widest, const Sampling& sampling)
      : sampling_(sampling) {
    for (const auto& point : view.sample_C) keep(point.cast<double>(), true, rough, widest);
    for (const auto& point : view.beyond_C) keep(point.cast<double>(), false, rough, widest);
  }

  [[nodiscard]] Verdict operator()(const Cylinder& cylinder) const {
    Verdict verdict;
    for (const Seen& seen : rays_) add(seen, cylinder, verdict);
    return verdict;
  }

 private:
  struct Seen {
    Eigen::Vector3d direction;
    double range;
    bool of_object;
  };

  void keep(const Eigen::Vector3d& point, bool of_object, const Cylinder& rough, double widest) {
    const double range = point.norm();
    if (!(range > 0)) return;
    const Pass passing = pass(point / range, rough);
    if (passing.distance < widest && passing.along > rough.from && passing.along < rough.to)
      rays_.push_back({point / range, range, of_object});
  }

  void add(const Seen& seen, const Cylinder& cylinder, Verdict& verdict) const {
    const auto& [direction, range, of_object] = seen;
    const auto met = sight(direction, cylinder);
    if (!met) {
      const double window = std::max(kLeastWindow, kWindow * sampling_.spacing(range));
      if (of_object && pass(direction, cylinder).distance > cylinder.radius + window) verdict.cost += kWorst;
      return;
    }
    if (met->incidence > -kSmallestIncidence) return;
    const double residual = range - met->range, deviation = sampling_.deviation(met->range) + kCylinderMisfit;
    const double square = residual * residual / (deviation * deviation);
    if (square < kWorst) {
      ++verdict.met;
      verdict.cost += square;
    } else if (residual > 0) {
      ++verdict.passed;
      verdict.cost += kWorst;
    } else if (of_object) {
      verdict.cost += kWorst;
    }  // otherwise something else is in front of it
  }

  const Sampling& sampling_;
  std::vector<Seen> rays_;
};

// The cylinder with another radius and the same front as seen by the sensor.
Cylinder with_radius(const Cylinder& cylinder, double radius) {
  Cylinder out = cylinder;
  const Eigen::Vector3d middle = cylinder.p_CA + (cylinder.from + cylinder.to) / 2 * cylinder.axis_C;
  const Eigen::Vector3d to_sensor = -middle + middle.dot(cylinder.axis_C) * cylinder.axis_C;
  out.p_CA += (cylinder.radius - radius) * to_sensor.normalized();
  out.radius = radius;
  return out;
}

}  // namespace

std::optional<Cylinder> best_cylinder(const ObjectView& view, const Cylinder& rough, const Sampling& sampling,
                                      int threads) {
  const double range = (rough.p_CA + (rough.from + rough.to) / 2 * rough.axis_C).norm();
  const double widest = rough.radius + std::max(kLeastWindow, kWindow * sampling.spacing(range));
  const RayComparison judge(view, rough, widest, sampling);
  std::optional<Cylinder> best;
  double least = 0;
  for (const double start : kStarts) {
    const Cylinder initial = with_radius(rough, start * rough.radius);
    auto fitted = refine_cylinder(view.sample_C, initial, sampling, threads);
    if (!fitted || (best && std::abs(fitted->radius - best->radius) < kSame)) continue;
    // All fits are compared over the same stretch of the axis.
    Cylinder compared = *fitted;
    const auto along = [&](double place) {
      return fitted->axis_C.dot(rough.p_CA + place * rough.axis_C - fitted->p_CA);
    };
    compared.from = std::min(along(rough.from), along(rough.to));
    compared.to = std::max(along(rough.from), along(rough.to));
    const double cost = judge(compared).cost;
    if (best && cost >= least) continue;
    best = compared;  // on that stretch, so that the next fit does not include what adjoins it
    least = cost;
  }
  if (!best) return std::nullopt;
  best = refine_cylinder(view.measured_C, *best, sampling, threads);
  if (!best || judge(*best).seen_through() > kMostSeenThrough) return std::nullopt;
  return best;
}

}  // namespace walkman::perception
