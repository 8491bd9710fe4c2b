#pragma once

#include <array>

#include "adaptation/motion/quadratic_program.h"

namespace walkman::motion {

inline constexpr int kMaxLevels = 6;  ///< feet, centre of mass, hand, upright, posture, and one to spare

/// Task rows, each contiguous, so that appending one does not move the others.
using TaskMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, kMaxVariables, kMaxVariables>;

/// One priority of a cascade: minimises |A x − b|² + damping |step|², where the step is what it adds to the
/// preceding levels' solution. A is rows × variables, b has as many rows, at most kMaxVariables.
struct PriorityLevel {
  TaskMatrix A;
  VariableVector b;
  double damping = 1e-6;
};

/// Least squares in strict order of priority under common inequalities.
///
/// Level i is minimised over the freedom that the preceding levels leave, so it never changes their
/// residuals; C x ≥ d holds at every level. The formulation is that of Escande, Mansard and Wieber (IJRR 33,
/// 2014), with each level's equality part handled by its null space, as in OpenSoT. A level that the
/// inequalities keep from its optimum still leaves only its null space to the next.
class PriorityCascade {
 public:
  /// Removes all levels and sets the number of variables, at most kMaxVariables.
  void clear(int variables) noexcept;
  /// Appends a level; returns nullptr if there are kMaxLevels already.
  [[nodiscard]] PriorityLevel* add_level(double damping = 1e-6) noexcept;

  /// C is m × variables, d has m rows. `x()` is zero unless the status is kSolved.
  [[nodiscard]] QpStatus solve(const InequalityMatrix& C, const InequalityVector& d) noexcept;
  /// The last solution, one entry per variable.
  [[nodiscard]] const VariableVector& x() const { return x_; }
  /// Lagrange multipliers of level `i`: how much each row of C kept it from its optimum. Empty when the level
  /// has not been solved.
  [[nodiscard]] const InequalityVector& multipliers(int i) const {
    return multipliers_[static_cast<std::size_t>(i)];
  }

 private:
  void project(const InequalityMatrix& C);
  void shrink_null_space();

  int variables_ = 0;
  int level_count_ = 0;
  std::array<PriorityLevel, kMaxLevels> levels_;

  QuadraticProgram program_;
  VariableVector x_;
  VariableMatrix Z_;  ///< orthonormal basis of the freedom that is left
  VariableMatrix AZ_, AZ_transposed_, G_, next_Z_;
  VariableVector g_, residual_;
  InequalityMatrix CZ_;
  std::array<int, kMaxInequalities> only_entry_{};  ///< column of a row's only entry in C; -1 if it has more
  InequalityVector slack_;
  std::array<InequalityVector, kMaxLevels> multipliers_;
};

}  // namespace walkman::motion
