#pragma once

#include <array>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace walkman::motion {

inline constexpr int kMaxVariables = 40;  ///< a floating base and every joint but the hands'
inline constexpr int kMaxInequalities = 120;

/// Matrices with in-place storage: resizing within the bounds never allocates.
using VariableVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxVariables, 1>;
using VariableMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxVariables, kMaxVariables>;
using InequalityVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxInequalities, 1>;
using InequalityMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, kMaxInequalities, kMaxVariables>;

enum class QpStatus {
  kSolved,
  kInfeasible,  ///< no x satisfies all inequalities
  kNotConvex,   ///< G is not positive definite, or an input is not finite
  kIterationLimit,
};

/// Strictly convex quadratic program: minimise ½ xᵀGx + gᵀx subject to C x ≥ d.
///
/// Dual active-set method of Goldfarb and Idnani (Mathematical Programming 27, 1983). Dense, at most
/// kMaxVariables variables and kMaxInequalities rows, no allocation.
class QuadraticProgram {
 public:
  /// Maximum number of active-set changes before giving up.
  int iteration_limit = 400;
  /// A row counts as satisfied when C x − d ≥ −tolerance (row norms are about one).
  double tolerance = 1e-10;

  /// G: n×n, symmetric positive definite, its lower triangle is used; g: n; C: m×n; d: m. On kSolved, `x()`
  /// is the minimiser.
  [[nodiscard]] QpStatus solve(const VariableMatrix& G, const VariableVector& g, const InequalityMatrix& C,
                               const InequalityVector& d) noexcept;

  [[nodiscard]] const VariableVector& x() const { return x_; }
  /// Lagrange multipliers of the last solution, m entries, zero for inactive rows: G x + g = Cᵀ multipliers.
  [[nodiscard]] const InequalityVector& multipliers() const { return multipliers_; }
  /// Number of active-set changes in the last solution.
  [[nodiscard]] int iterations() const { return iterations_; }

 private:
  [[nodiscard]] int most_violated_row(const InequalityMatrix& C, const InequalityVector& d);
  void prepare_factors();
  [[nodiscard]] QpStatus enforce(int row, const InequalityMatrix& C, const InequalityVector& d);
  void add_to_active_set(int row, double multiplier);
  void drop_from_active_set(int position);
  void rotate_factors(int column, double cosine, double sine);

  VariableVector x_;
  InequalityVector multipliers_, slack_;
  int iterations_ = 0;

  Eigen::LLT<VariableMatrix> cholesky_{VariableMatrix()};  ///< default-constructed, its info() is not set
  VariableMatrix J_;  ///< G⁻¹ = J Jᵀ; its first columns span the active rows' normals in the metric of G
  VariableMatrix R_;  ///< upper triangular: Jᵀ N = [R; 0] for the active normals N
  VariableVector projected_normal_, primal_step_, dual_step_;
  int active_count_ = 0;
  std::array<int, kMaxVariables> active_{};
  std::array<double, kMaxVariables> active_multiplier_{};
  std::array<bool, kMaxInequalities> is_active_{};
};

}  // namespace walkman::motion
