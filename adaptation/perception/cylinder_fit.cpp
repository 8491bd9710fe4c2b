#include "adaptation/perception/cylinder_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "adaptation/perception/parallel_parts.h"

namespace walkman::perception {
namespace {

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;

constexpr int kIterations = 18;
constexpr double kTukey = 4.685;          // 95 % efficiency for Gaussian noise
constexpr double kSmallestSpread = 1e-4;  // m, floor of the residuals' spread
constexpr double kLargestMove = 0.05;     // m
constexpr std::size_t kFewestOfCylinder = 30;
constexpr std::size_t kMostPoints = 12000;  // neighbouring points share their noise: more add no information
constexpr std::size_t kRaysAtATime = 2000;  // points that a thread processes at a time
constexpr double kBin = 0.002;              // m, resolution of the ends
// Largest residual of a point that counts, m: initially, then, and finally `kLastSpread` standard deviations.
constexpr double kFirstResidual = 0.03, kSecondResidual = 0.015, kLeastResidual = 0.005;
constexpr double kLastSpread = 4;
constexpr int kCoarse = 3, kFine = 6;  // iterations from which the second and the last limit apply

struct Ray {
  Eigen::Vector3d direction;
  double range;
};

// A sighting that counts, as an equation for axis position (two), direction (two) and radius.
struct Equation {
  Vector5 row;
  double residual, weight;
};

// Coordinates of a cylinder's motion: shift across its axis, and rotation as the displacement of its ends.
struct Across {
  Eigen::Vector3d e1, e2;
  double half, middle;

  explicit Across(const Cylinder& cylinder)
      : e1(cylinder.axis_C.unitOrthogonal()),
        e2(cylinder.axis_C.cross(e1)),
        half(std::max(1e-3, (cylinder.to - cylinder.from) / 2)),
        middle((cylinder.from + cylinder.to) / 2) {}

  [[nodiscard]] Vector5 row(const Sighting& s) const {
    const double n1 = s.n_C.dot(e1), n2 = s.n_C.dot(e2), t = (s.along - middle) / half;
    return Vector5(n1, n2, t * n1, t * n2, 1.0) / s.incidence;
  }
};

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double tukey(double residual, double limit) {
  const double q = residual / limit;
  return std::abs(q) >= 1 ? 0 : (1 - q * q) * (1 - q * q);
}

std::vector<Ray> rays_of(std::span<const Eigen::Vector3f> points_C, const Cylinder& around) {
  std::vector<Ray> rays;
  for (const auto& point : points_C) {
    const Eigen::Vector3d p = point.cast<double>(), w = p - around.p_CA;
    const double along = around.axis_C.dot(w);
    const double distance = (w - along * around.axis_C).norm();
    if (along < around.from - kLargestMove || along > around.to + kLargestMove ||
        distance > around.radius + kLargestMove)
      continue;
    rays.push_back({p.normalized(), p.norm()});
  }
  return rays;
}

std::vector<Ray> thinned(const std::vector<Ray>& rays) {
  const std::size_t stride = (rays.size() + kMostPoints - 1) / kMostPoints;
  if (stride <= 1) return rays;
  std::vector<Ray> out;
  for (std::size_t i = 0; i < rays.size(); i += stride) out.push_back(rays[i]);
  return out;
}

// Equations of the rays that meet the cylinder, in order, weighted by range alone.
std::vector<Equation> readings_of(std::span<const Ray> rays, const Cylinder& cylinder, const Across& across,
                                  double largest_residual) {
  std::vector<Equation> readings;
  readings.reserve(rays.size());
  for (const Ray& ray : rays) {
    const auto s = sight(ray.direction, cylinder);
    if (!s || s->incidence > -kSmallestIncidence) continue;
    const double residual = ray.range - s->range;
    if (std::abs(residual) > largest_residual) continue;
    const double square = s->range * s->range;
    readings.push_back({across.row(*s), residual, 1 / (square * square)});
  }
  return readings;
}

// One Gauss-Newton step; returns the length of the move in m, negative if too few points fit.
double step(const std::vector<Ray>& rays, double largest_residual, Cylinder& cylinder, int threads) {
  const Across across(cylinder);
  std::vector<std::vector<Equation>> parts((rays.size() + kRaysAtATime - 1) / kRaysAtATime);
  for_ranges(threads, rays.size(), kRaysAtATime, [&](std::size_t first, std::size_t last) {
    parts[first / kRaysAtATime] =
        readings_of(std::span(rays).subspan(first, last - first), cylinder, across, largest_residual);
  });
  std::vector<double> magnitudes;
  magnitudes.reserve(rays.size());
  for (const auto& part : parts)
    for (const Equation& r : part) magnitudes.push_back(std::abs(r.residual));
  if (magnitudes.size() < kFewestOfCylinder) return -1;
  const double limit = kTukey * std::max(kSmallestSpread, kGaussian * median(magnitudes));

  Matrix5 normal_matrix = Matrix5::Zero();
  Vector5 right = Vector5::Zero();
  for (const auto& part : parts)
    for (const Equation& r : part) {
      const double weight = tukey(r.residual, limit) * r.weight;
      normal_matrix.noalias() += weight * r.row * r.row.transpose();
      right.noalias() += weight * r.residual * r.row;
    }
  const Vector5 x = normal_matrix.ldlt().solve(right);
  if (!x.allFinite()) return -1;
  const Eigen::Vector3d turn = (x[2] * across.e1 + x[3] * across.e2) / across.half;
  // The rotation is about the midpoint between the ends.
  cylinder.p_CA += x[0] * across.e1 + x[1] * across.e2 - across.middle * turn;
  cylinder.axis_C = (cylinder.axis_C + turn).normalized();
  cylinder.radius += x[4];
  return x.norm();
}

// Sets the ends to the outermost bins that hold at least a quarter of the median count of fitting points.
bool find_ends(const std::vector<Ray>& rays, double largest_residual, Cylinder& cylinder) {
  const auto bins = static_cast<std::size_t>(std::max(1.0, std::ceil((cylinder.to - cylinder.from) / kBin)));
  std::vector<std::size_t> counts(bins, 0);
  std::size_t total = 0;
  for (const Ray& ray : rays) {
    const auto s = sight(ray.direction, cylinder);
    if (!s || s->incidence > -kSmallestIncidence || std::abs(ray.range - s->range) > largest_residual)
      continue;
    ++counts[std::min(bins - 1, static_cast<std::size_t>((s->along - cylinder.from) / kBin))];
    ++total;
  }
  if (total < kFewestOfCylinder) return false;
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

double last_residual(const Cylinder& cylinder, const Sampling& sampling) {
  const double range = (cylinder.p_CA + (cylinder.from + cylinder.to) / 2 * cylinder.axis_C).norm();
  return std::max(kLeastResidual, kLastSpread * sampling.deviation(range));
}

constexpr double kPatch = 0.05;      // m along the axis
constexpr std::size_t kSectors = 3;  // about the axis, over the half that the sensor can see
constexpr std::size_t kFewestPatches = 6;
constexpr double kArcBin = 5 * M_PI / 180;
constexpr std::size_t kArcBins = 36;
constexpr double kRim = 0.1;              // cosine between ray and normal
constexpr double kProfileBin = 0.01;      // m
constexpr std::size_t kShortestPart = 5;  // bins on either side of a change of the radius

// Normal equations of a stretch of the axis.
struct Stretch {
  Matrix5 normal_matrix = Matrix5::Zero();
  Vector5 right = Vector5::Zero();

  void add(const Equation& r, double weight) {
    normal_matrix.noalias() += weight * r.row * r.row.transpose();
    right.noalias() += weight * r.residual * r.row;
  }
  [[nodiscard]] Stretch plus(const Stretch& other) const {
    return {normal_matrix + other.normal_matrix, right + other.right};
  }
  [[nodiscard]] Stretch minus(const Stretch& other) const {
    return {normal_matrix - other.normal_matrix, right - other.right};
  }
  // Move that fits the cylinder to the stretch. A short stretch separates direction and radius poorly; the
  // damping term against large moves equals that of one point in a hundred.
  [[nodiscard]] Vector5 move() const {
    Matrix5 held = normal_matrix;
    held.diagonal().array() += 0.01 * normal_matrix.trace() / 5;
    return held.ldlt().solve(right);
  }
};

// Position at which replacing the cylinder by two reduces the residuals' sum of squares most.
std::optional<CylinderFigures::Step> largest_step(const std::vector<Stretch>& bins, double start) {
  if (bins.size() < 2 * kShortestPart) return std::nullopt;
  std::vector<Stretch> sums{Stretch{}};
  for (const Stretch& bin : bins) sums.push_back(sums.back().plus(bin));
  std::optional<CylinderFigures::Step> best;
  double most = 0;
  for (std::size_t i = kShortestPart; i + kShortestPart <= bins.size(); ++i) {
    const Stretch &before = sums[i], beyond = sums.back().minus(sums[i]);
    const Vector5 x = before.move(), y = beyond.move();
    const double gain = x.dot(before.right) + y.dot(beyond.right);
    if (!(gain > most)) continue;
    most = gain;
    best = CylinderFigures::Step{start + static_cast<double>(i) * kProfileBin, y[4] - x[4]};
  }
  return best;
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

std::optional<Sighting> sight(const Eigen::Vector3d& direction_C, const Cylinder& cylinder) {
  const Eigen::Vector3d u = direction_C - direction_C.dot(cylinder.axis_C) * cylinder.axis_C;
  const Eigen::Vector3d w = -cylinder.p_CA + cylinder.p_CA.dot(cylinder.axis_C) * cylinder.axis_C;
  const double a = u.squaredNorm(), b = u.dot(w), c = w.squaredNorm() - cylinder.radius * cylinder.radius;
  const double discriminant = b * b - a * c;
  if (!(discriminant > 0) || a < 1e-12) return std::nullopt;
  Sighting out;
  out.range = (-b - std::sqrt(discriminant)) / a;
  if (out.range <= 0) return std::nullopt;
  out.along = cylinder.axis_C.dot(out.range * direction_C - cylinder.p_CA);
  if (out.along < cylinder.from || out.along > cylinder.to) return std::nullopt;
  out.n_C = (w + out.range * u) / cylinder.radius;
  out.incidence = out.n_C.dot(direction_C);
  return out;
}

std::optional<Cylinder> refine_cylinder(std::span<const Eigen::Vector3f> points_C, const Cylinder& initial,
                                        const Sampling& sampling, int threads) {
  const std::vector<Ray> rays = rays_of(points_C, initial), fitted = thinned(rays);
  Cylinder cylinder = initial;
  // Positions along the axis are measured from the middle.
  const double middle = (initial.from + initial.to) / 2;
  cylinder.p_CA += middle * cylinder.axis_C;
  cylinder.from -= middle;
  cylinder.to -= middle;
  const Eigen::Vector3d start = cylinder.p_CA;
  const double last = last_residual(cylinder, sampling);
  for (int i = 0; i < kIterations; ++i) {
    const double limit = i < kCoarse ? std::max(last, kFirstResidual)
                         : i < kFine ? std::max(last, kSecondResidual)
                                     : last;
    const double move = step(fitted, limit, cylinder, threads);
    if (move < 0 || !((cylinder.p_CA - start).norm() < kLargestMove) || !(cylinder.radius > 0))
      return std::nullopt;
    if (move < 1e-6 && i >= kFine) break;
    // The wide limits gain nothing once the iteration has converged.
    if (move < 1e-5 && i < kFine) i = i < kCoarse ? kCoarse - 1 : kFine - 1;
  }
  cylinder.from -= kLargestMove;
  cylinder.to += kLargestMove;
  if (!find_ends(rays, last, cylinder)) return std::nullopt;
  return cylinder;
}

std::optional<CylinderFigures> cylinder_figures(std::span<const Eigen::Vector3f> points_C,
                                                const Cylinder& cylinder, const Sampling& sampling) {
  const Across across(cylinder);
  const double largest = std::max(kSecondResidual, last_residual(cylinder, sampling));
  const std::vector<Ray> rays = thinned(rays_of(points_C, cylinder));
  const Eigen::Vector3d to_sensor = -(cylinder.p_CA + across.middle * cylinder.axis_C);
  const Eigen::Vector3d front = (to_sensor - to_sensor.dot(cylinder.axis_C) * cylinder.axis_C).normalized();
  const Eigen::Vector3d side = cylinder.axis_C.cross(front);

  struct Placed {
    Equation reading;
    double along, angle;
  };
  std::vector<Placed> placed;
  std::vector<double> magnitudes, off_surface;
  std::array<std::size_t, kArcBins> arc{};
  for (const Ray& ray : rays) {
    const auto s = sight(ray.direction, cylinder);
    if (!s || s->incidence > -kRim) continue;
    const double residual = ray.range - s->range;
    const double angle = std::atan2(s->n_C.dot(side), s->n_C.dot(front));  // within ±90°, or slightly beyond
    const double across_surface = std::abs(residual * s->incidence);
    if (across_surface < std::max(kLeastResidual, largest / 2))
      ++arc[static_cast<std::size_t>(
          std::clamp((angle + M_PI / 2) / kArcBin, 0.0, static_cast<double>(kArcBins) - 1))];
    if (s->incidence > -kSmallestIncidence || std::abs(residual) > largest) continue;
    const double square = s->range * s->range;
    placed.push_back({{across.row(*s), residual, 1 / (square * square)}, s->along, angle});
    magnitudes.push_back(std::abs(residual));
    off_surface.push_back(across_surface);
  }
  if (placed.size() < kFewestOfCylinder) return std::nullopt;
  CylinderFigures out;
  out.residual = kGaussian * median(off_surface);
  const std::size_t fullest = *std::max_element(arc.begin(), arc.end());
  out.arc = kArcBin * static_cast<double>(std::count_if(arc.begin(), arc.end(), [fullest](std::size_t n) {
              return n >= 3 && 20 * n >= fullest;
            }));

  const double limit = kTukey * std::max(kSmallestSpread, kGaussian * median(magnitudes));
  const double length = cylinder.to - cylinder.from;
  const auto patches = static_cast<std::size_t>(length / kPatch) + 1;
  std::vector<Vector5> sums(patches * kSectors, Vector5::Zero());
  std::vector<Stretch> profile(static_cast<std::size_t>(length / kProfileBin) + 1);
  Stretch all;
  for (const Placed& p : placed) {
    const double weight = tukey(p.reading.residual, limit) * p.reading.weight;
    const double along = p.along - cylinder.from;
    const auto sector = static_cast<std::size_t>(std::clamp(
        (p.angle / M_PI + 0.5) * static_cast<double>(kSectors), 0.0, static_cast<double>(kSectors) - 1));
    sums[std::min(patches - 1, static_cast<std::size_t>(along / kPatch)) * kSectors + sector] +=
        weight * p.reading.residual * p.reading.row;
    profile[std::min(profile.size() - 1, static_cast<std::size_t>(along / kProfileBin))].add(p.reading,
                                                                                             weight);
    all.add(p.reading, weight);
  }
  Matrix5 scatter = Matrix5::Zero();
  std::size_t filled = 0;
  for (const Vector5& sum : sums) {
    if (sum.isZero()) continue;
    scatter += sum * sum.transpose();
    ++filled;
  }
  if (filled < kFewestPatches) return std::nullopt;
  const Matrix5 inverse = all.normal_matrix.ldlt().solve(Matrix5::Identity());
  const Matrix5 covariance =
      inverse * scatter * inverse * (static_cast<double>(filled) / static_cast<double>(filled - 5));
  const auto worse = [&](int first) {
    const Eigen::Matrix2d block = covariance.block<2, 2>(first, first);
    return std::sqrt(std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(block).eigenvalues()[1]));
  };
  out.radius_deviation = std::sqrt(std::max(0.0, covariance(4, 4)));
  out.position_deviation = worse(0);
  out.axis_deviation = worse(2) / across.half;
  out.step = largest_step(profile, cylinder.from);
  return out;
}

}  // namespace walkman::perception
