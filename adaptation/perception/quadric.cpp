#include "adaptation/perception/quadric.h"

#include <array>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

namespace walkman::perception {
namespace {

constexpr int kTerms = 9;
using Matrix9 = Eigen::Matrix<double, kTerms, kTerms>;
using Vector9 = Eigen::Matrix<double, kTerms, 1>;

// Exponents of x, y, z in the nine terms of a quadric without its constant.
constexpr std::array<std::array<int, 3>, kTerms> kExponents{
    {{2, 0, 0}, {0, 2, 0}, {0, 0, 2}, {1, 1, 0}, {0, 1, 1}, {1, 0, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

// Σ x^i y^j z^k over the points, for i + j + k <= 4.
class Moments {
 public:
  void add(const Eigen::Vector3d& s) {
    double x = 1;
    for (int i = 0; i <= 4; ++i, x *= s.x()) {
      double xy = x;
      for (int j = 0; i + j <= 4; ++j, xy *= s.y()) {
        double xyz = xy;
        for (int k = 0; i + j + k <= 4; ++k, xyz *= s.z()) at(i, j, k) += xyz;
      }
    }
  }
  double& at(int i, int j, int k) { return sums_[index(i, j, k)]; }
  [[nodiscard]] double get(int i, int j, int k) const { return sums_[index(i, j, k)]; }

 private:
  static std::size_t index(int i, int j, int k) {
    return (static_cast<std::size_t>(i) * 5 + static_cast<std::size_t>(j)) * 5 + static_cast<std::size_t>(k);
  }

  std::array<double, 125> sums_{};
};

Vector9 smallest_ratio(const Moments& m) {
  const double count = m.get(0, 0, 0);
  Vector9 mean;
  for (int a = 0; a < kTerms; ++a) {
    const auto& e = kExponents[static_cast<std::size_t>(a)];
    mean[a] = m.get(e[0], e[1], e[2]) / count;
  }
  Matrix9 values, gradients;
  for (int a = 0; a < kTerms; ++a)
    for (int b = 0; b <= a; ++b) {
      const auto &e = kExponents[static_cast<std::size_t>(a)], &f = kExponents[static_cast<std::size_t>(b)];
      std::array<int, 3> sum{};
      for (std::size_t d = 0; d < 3; ++d) sum[d] = e[d] + f[d];
      values(a, b) = values(b, a) = m.get(sum[0], sum[1], sum[2]) / count - mean[a] * mean[b];
      double product = 0;
      for (std::size_t d = 0; d < 3; ++d) {
        if (e[d] == 0 || f[d] == 0) continue;
        std::array<int, 3> lowered = sum;
        lowered[d] -= 2;
        product += e[d] * f[d] * m.get(lowered[0], lowered[1], lowered[2]) / count;
      }
      gradients(a, b) = gradients(b, a) = product;
    }
  // On planar points some combinations of terms have no gradient at all; this keeps the matrix definite.
  gradients.diagonal().array() += 1e-9;
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix9> solver(values, gradients);
  Vector9 q = solver.eigenvectors().col(0);
  return q;
}

}  // namespace

std::optional<Quadric> fit_quadric(std::span<const Eigen::Vector3f> points_C,
                                   std::span<const std::uint32_t> chosen) {
  if (chosen.size() < kTerms + 1) return std::nullopt;
  const auto count = static_cast<double>(chosen.size());
  Quadric quadric;
  for (const std::uint32_t i : chosen) quadric.p_CO += points_C[i].cast<double>() / count;
  double spread = 0;
  for (const std::uint32_t i : chosen)
    spread += (points_C[i].cast<double>() - quadric.p_CO).squaredNorm() / count;
  quadric.scale = std::sqrt(spread);
  if (!(quadric.scale > 1e-9)) return std::nullopt;

  Moments moments;
  for (const std::uint32_t i : chosen)
    moments.add((points_C[i].cast<double>() - quadric.p_CO) / quadric.scale);
  const Vector9 q = smallest_ratio(moments);
  if (!q.allFinite()) return std::nullopt;
  quadric.A << q[0], q[3] / 2, q[5] / 2, q[3] / 2, q[1], q[4] / 2, q[5] / 2, q[4] / 2, q[2];
  quadric.b = q.tail<3>();
  // The constant that minimises Σq²; the first moments vanish.
  quadric.c = -(q[0] * moments.get(2, 0, 0) + q[1] * moments.get(0, 2, 0) + q[2] * moments.get(0, 0, 2) +
                q[3] * moments.get(1, 1, 0) + q[4] * moments.get(0, 1, 1) + q[5] * moments.get(1, 0, 1)) /
              count;
  return quadric;
}

std::optional<PrincipalCurvatures> principal_curvatures(const Quadric& quadric, const Eigen::Vector3d& p_CP) {
  const Eigen::Vector3d gradient = 2 * quadric.A * (p_CP - quadric.p_CO) / quadric.scale + quadric.b;
  const double length = gradient.norm();
  if (!(length > 1e-9)) return std::nullopt;
  PrincipalCurvatures out;
  const double side = gradient.dot(p_CP) > 0 ? -1 : 1;
  out.n_C = side * gradient / length;
  // The shape operator in the tangent plane: the Hessian over the gradient's length.
  const Eigen::Vector3d u = out.n_C.unitOrthogonal(), v = out.n_C.cross(u);
  const double factor = side * 2 / (length * quadric.scale);
  const double uu = factor * u.dot(quadric.A * u), uv = factor * u.dot(quadric.A * v),
               vv = factor * v.dot(quadric.A * v);
  const double mean = (uu + vv) / 2, half = std::hypot((uu - vv) / 2, uv);
  const double angle = 0.5 * std::atan2(2 * uv, uu - vv);  // of the direction of mean + half
  const Eigen::Vector3d high = std::cos(angle) * u + std::sin(angle) * v;
  const Eigen::Vector3d low = out.n_C.cross(high);
  const bool high_is_larger = std::abs(mean + half) >= std::abs(mean - half);
  out.largest = high_is_larger ? mean + half : mean - half;
  out.smallest = high_is_larger ? mean - half : mean + half;
  out.along_smallest_C = high_is_larger ? low : high;
  return out;
}

}  // namespace walkman::perception
