#include "adaptation/perception/cylinder_fit.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

namespace walkman::perception {
namespace {

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;

constexpr int kIterations = 15;
constexpr double kSmallestIncidence = 0.5;  // cosine between ray and surface normal
constexpr double kLargestResidual = 0.015;  // m, of a point that counts; twice that in the first iterations
constexpr double kTukey = 4.685;            // 95 % efficiency on Gaussian noise
constexpr double kSmallestSpread = 1e-4;    // m, floor of the residuals' spread
constexpr double kLargestMove = 0.05;       // m
constexpr std::size_t kFewestPoints = 30;
constexpr double kBin = 0.002;  // m, resolution of the ends

struct Ray {
  Eigen::Vector3d direction;
  double range;
};

// A ray's meeting with the cylinder: its residual in inverse range times `square`, and what moves it.
struct Sighting {
  Eigen::Vector3d normal;
  double along, residual, weight_scale, incidence;
};

// None when the ray misses, grazes or meets the cylinder outside its ends.
std::optional<Sighting> sight(const Ray& ray, const Cylinder& cylinder) {
  const Eigen::Vector3d u = ray.direction - ray.direction.dot(cylinder.axis_C) * cylinder.axis_C;
  const Eigen::Vector3d w = -cylinder.p_CA + cylinder.p_CA.dot(cylinder.axis_C) * cylinder.axis_C;
  const double a = u.squaredNorm(), b = u.dot(w), c = w.squaredNorm() - cylinder.radius * cylinder.radius;
  const double discriminant = b * b - a * c;
  if (!(discriminant > 0) || a < 1e-12) return std::nullopt;
  const double range = (-b - std::sqrt(discriminant)) / a;
  if (range <= 0) return std::nullopt;
  Sighting out;
  out.normal = (w + range * u) / cylinder.radius;
  out.incidence = out.normal.dot(ray.direction);
  if (out.incidence > -kSmallestIncidence) return std::nullopt;
  out.along = cylinder.axis_C.dot(range * ray.direction - cylinder.p_CA);
  if (out.along < cylinder.from || out.along > cylinder.to) return std::nullopt;
  out.residual = ray.range - range;
  out.weight_scale = 1 / (range * range);
  return out;
}

double median_magnitude(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double tukey(double residual, double limit) {
  const double q = residual / limit;
  return std::abs(q) >= 1 ? 0 : (1 - q * q) * (1 - q * q);
}

// One Gauss-Newton step; returns the length of the move in m, negative when too few points fit.
double step(const std::vector<Ray>& rays, double largest_residual, Cylinder& cylinder) {
  std::vector<Sighting> sightings;
  sightings.reserve(rays.size());
  std::vector<double> magnitudes;
  for (const Ray& ray : rays) {
    const auto s = sight(ray, cylinder);
    if (!s || std::abs(s->residual) > largest_residual) continue;
    sightings.push_back(*s);
    magnitudes.push_back(std::abs(s->residual));
  }
  if (sightings.size() < kFewestPoints) return -1;
  const double limit = kTukey * std::max(kSmallestSpread, 1.4826 * median_magnitude(magnitudes));

  const Eigen::Vector3d e1 = cylinder.axis_C.unitOrthogonal(), e2 = cylinder.axis_C.cross(e1);
  const double half = std::max(1e-3, (cylinder.to - cylinder.from) / 2);
  Matrix5 normal_matrix = Matrix5::Zero();
  Vector5 right = Vector5::Zero();
  for (const Sighting& s : sightings) {
    const double n1 = s.normal.dot(e1), n2 = s.normal.dot(e2), t = s.along / half;
    const Vector5 row = Vector5(n1, n2, t * n1, t * n2, 1.0) / s.incidence;
    const double weight = tukey(s.residual, limit) * s.weight_scale * s.weight_scale;
    normal_matrix.noalias() += weight * row * row.transpose();
    right.noalias() += weight * s.residual * row;
  }
  const Vector5 x = normal_matrix.ldlt().solve(right);
  if (!x.allFinite()) return -1;
  cylinder.p_CA += x[0] * e1 + x[1] * e2;
  cylinder.axis_C = (cylinder.axis_C + (x[2] * e1 + x[3] * e2) / half).normalized();
  cylinder.radius += x[4];
  return x.norm();
}

// Ends of the bins that hold at least a quarter of the median count of fitting points.
bool find_ends(const std::vector<Ray>& rays, Cylinder& cylinder) {
  const auto bins = static_cast<std::size_t>(std::max(1.0, std::ceil((cylinder.to - cylinder.from) / kBin)));
  std::vector<std::size_t> counts(bins, 0);
  std::size_t total = 0;
  for (const Ray& ray : rays) {
    const auto s = sight(ray, cylinder);
    if (!s || std::abs(s->residual) > kLargestResidual) continue;
    ++counts[std::min(bins - 1, static_cast<std::size_t>((s->along - cylinder.from) / kBin))];
    ++total;
  }
  if (total < kFewestPoints) return false;
  std::vector<std::size_t> occupied;
  std::copy_if(counts.begin(), counts.end(), std::back_inserter(occupied),
               [](std::size_t n) { return n > 0; });
  std::sort(occupied.begin(), occupied.end());
  const std::size_t enough = std::max<std::size_t>(1, occupied[occupied.size() / 2] / 4);
  std::size_t first = 0, last = bins - 1;
  while (counts[first] < enough) ++first;
  while (counts[last] < enough) --last;
  const double start = cylinder.from;
  cylinder.from = start + static_cast<double>(first) * kBin;
  cylinder.to = std::min(cylinder.to, start + static_cast<double>(last + 1) * kBin);
  return true;
}

}  // namespace

std::optional<Circle> fit_circle(std::span<const Eigen::Vector2d> points) {
  if (points.size() < 3) return std::nullopt;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& p : points) mean += p;
  mean /= static_cast<double>(points.size());
  // With centred coordinates, |d|² = 2 d·m + k is linear in the centre m and in k, and k is the mean of |d|².
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  Eigen::Vector2d cubic = Eigen::Vector2d::Zero();
  double square = 0;
  for (const auto& p : points) {
    const Eigen::Vector2d d = p - mean;
    moments.noalias() += d * d.transpose();
    cubic += d.squaredNorm() * d;
    square += d.squaredNorm();
  }
  const double trace = moments.trace();
  if (!(moments.determinant() > 1e-12 * trace * trace)) return std::nullopt;
  const Eigen::Vector2d m = moments.inverse() * cubic / 2;
  Circle circle;
  circle.centre = mean + m;
  circle.radius = std::sqrt(square / static_cast<double>(points.size()) + m.squaredNorm());
  return circle;
}

std::optional<Cylinder> refine_cylinder(std::span<const Eigen::Vector3f> points_C, const Cylinder& initial) {
  Cylinder cylinder = initial;
  std::vector<Ray> rays;
  for (const auto& point : points_C) {
    const Eigen::Vector3d p = point.cast<double>(), w = p - initial.p_CA;
    const double along = initial.axis_C.dot(w);
    const double distance = (w - along * initial.axis_C).norm();
    if (along < initial.from - kLargestMove || along > initial.to + kLargestMove ||
        distance > initial.radius + kLargestMove)
      continue;
    rays.push_back({p.normalized(), p.norm()});
  }
  // Positions along the axis are counted from the middle, where direction and position do not disturb each
  // other.
  const double middle = (initial.from + initial.to) / 2;
  cylinder.p_CA += middle * cylinder.axis_C;
  cylinder.from -= middle;
  cylinder.to -= middle;
  const Eigen::Vector3d start = cylinder.p_CA;
  for (int i = 0; i < kIterations; ++i) {
    const double largest_residual = i < 3 ? kLargestResidual * 2 : kLargestResidual;
    const double move = step(rays, largest_residual, cylinder);
    if (move < 0 || !((cylinder.p_CA - start).norm() < kLargestMove) || !(cylinder.radius > 0))
      return std::nullopt;
    if (move < 1e-6 && i >= 3) break;
  }
  cylinder.from -= kLargestMove;
  cylinder.to += kLargestMove;
  if (!find_ends(rays, cylinder)) return std::nullopt;
  return cylinder;
}

}  // namespace walkman::perception
