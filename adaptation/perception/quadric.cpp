#include "adaptation/perception/quadric.h"

#include <array>
#include <cmath>

#include <Eigen/Cholesky>
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

constexpr int kMonomials = 35;  // x^i y^j z^k with i + j + k <= 4

constexpr std::array<std::array<std::array<int, 5>, 5>, 5> number_monomials() {
  std::array<std::array<std::array<int, 5>, 5>, 5> numbers{};
  int next = 0;
  for (std::size_t i = 0; i <= 4; ++i)
    for (std::size_t j = 0; i + j <= 4; ++j)
      for (std::size_t k = 0; i + j + k <= 4; ++k) numbers[i][j][k] = next++;
  return numbers;
}
constexpr auto kNumber = number_monomials();

// Σ x^i y^j z^k over the points.
class Moments {
 public:
  void add(const Eigen::Vector3d& s) {
    const std::array<double, 5> x = powers(s.x()), y = powers(s.y()), z = powers(s.z());
    std::size_t next = 0;  // in the order of kNumber
    for (std::size_t i = 0; i <= 4; ++i)
      for (std::size_t j = 0; i + j <= 4; ++j) {
        const double xy = x[i] * y[j];
        for (std::size_t k = 0; i + j + k <= 4; ++k) sums_[next++] += xy * z[k];
      }
  }
  [[nodiscard]] double get(int i, int j, int k) const {
    return sums_[static_cast<std::size_t>(
        kNumber[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)][static_cast<std::size_t>(k)])];
  }

 private:
  static std::array<double, 5> powers(double v) { return {1, v, v * v, v * v * v, v * v * v * v}; }

  std::array<double, kMonomials> sums_{};
};

// Eigenvector of values q = λ gradients q with the smallest λ, by inverse iteration, which converges in a few
// steps for points on a quadric; if two λ nearly coincide, the full eigenproblem is solved.
Vector9 smallest_eigenvector(const Matrix9& values, const Matrix9& gradients) {
  constexpr int kIterations = 30;
  constexpr double kConverged = 1e-10;  // squared sine of the angle between successive vectors
  Matrix9 regular = values;
  regular.diagonal().array() += 1e-13 * values.trace();
  const Eigen::LLT<Matrix9> factor(regular);
  if (factor.info() == Eigen::Success) {
    Vector9 q = Vector9::Ones();
    q /= std::sqrt(q.dot(gradients * q));
    for (int i = 0; i < kIterations; ++i) {
      Vector9 next = factor.solve(gradients * q);
      next /= std::sqrt(next.dot(gradients * next));
      const double cosine = next.dot(gradients * q);
      q = next;
      if (!(1 - cosine * cosine > kConverged)) break;
      if (i + 1 == kIterations) q.setZero();
    }
    if (q.allFinite() && !q.isZero()) return q;
  }
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix9> solver(values, gradients);
  return solver.eigenvectors().col(0);
}

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
  // For coplanar points some combinations of terms have zero gradient; this keeps the matrix definite.
  gradients.diagonal().array() += 1e-9;
  return smallest_eigenvector(values, gradients);
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
  // Shape operator in the tangent plane: the Hessian divided by the gradient's length.
  const Eigen::Vector3d u = out.n_C.unitOrthogonal(), v = out.n_C.cross(u);
  const double factor = side * 2 / (length * quadric.scale);
  const double uu = factor * u.dot(quadric.A * u), uv = factor * u.dot(quadric.A * v),
               vv = factor * v.dot(quadric.A * v);
  const double mean = (uu + vv) / 2, half = std::hypot((uu - vv) / 2, uv);
  const double angle = 0.5 * std::atan2(2 * uv, uu - vv);  // of the direction belonging to mean + half
  const Eigen::Vector3d high = std::cos(angle) * u + std::sin(angle) * v;
  const Eigen::Vector3d low = out.n_C.cross(high);
  const bool high_is_larger = std::abs(mean + half) >= std::abs(mean - half);
  out.largest = high_is_larger ? mean + half : mean - half;
  out.smallest = high_is_larger ? mean - half : mean + half;
  out.along_smallest_C = high_is_larger ? low : high;
  return out;
}

}  // namespace walkman::perception
