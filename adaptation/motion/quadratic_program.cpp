#include "adaptation/motion/quadratic_program.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace walkman::motion {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::size_t slot(int i) { return static_cast<std::size_t>(i); }

/// Without std::hypot's guard against squares outside a double's range, which was a tenth of the solver's
/// time.
double length_of(double a, double b) { return std::sqrt(a * a + b * b); }

}  // namespace

QpStatus QuadraticProgram::solve(const VariableMatrix& G, const VariableVector& g, const InequalityMatrix& C,
                                 const InequalityVector& d) noexcept {
  const auto rows = static_cast<int>(d.size());
  iterations_ = 0;
  active_count_ = 0;
  is_active_.fill(false);
  multipliers_.setZero(rows);
  if (!G.allFinite() || !g.allFinite() || !C.allFinite() || !d.allFinite()) return QpStatus::kNotConvex;

  cholesky_.compute(G);
  if (cholesky_.info() != Eigen::Success) return QpStatus::kNotConvex;
  x_ = -g;
  cholesky_.solveInPlace(x_);

  for (int row = most_violated_row(C, d); row >= 0; row = most_violated_row(C, d)) {
    if (iterations_ == 0) prepare_factors();
    const QpStatus status = enforce(row, C, d);
    if (status != QpStatus::kSolved) return status;
  }
  for (int i = 0; i < active_count_; ++i) multipliers_[active_[slot(i)]] = active_multiplier_[slot(i)];
  return QpStatus::kSolved;
}

void QuadraticProgram::prepare_factors() {
  const auto variables = static_cast<int>(x_.size());
  J_.setIdentity(variables, variables);
  cholesky_.matrixU().solveInPlace(J_);
  R_.setZero(variables, variables);
  projected_normal_.setZero(variables);
  primal_step_.setZero(variables);
  dual_step_.setZero(variables);
}

int QuadraticProgram::most_violated_row(const InequalityMatrix& C, const InequalityVector& d) {
  slack_ = -d;
  slack_.noalias() += C * x_;
  int worst_row = -1;
  double worst = -tolerance;
  for (int i = 0; i < d.size(); ++i) {
    if (is_active_[slot(i)]) continue;
    if (slack_[i] < worst) {
      worst = slack_[i];
      worst_row = i;
    }
  }
  return worst_row;
}

QpStatus QuadraticProgram::enforce(int row, const InequalityMatrix& C, const InequalityVector& d) {
  const auto variables = static_cast<int>(x_.size());
  double multiplier = 0;
  for (;;) {
    if (++iterations_ > iteration_limit) return QpStatus::kIterationLimit;
    const int k = active_count_;
    projected_normal_.noalias() = J_.transpose() * C.row(row).transpose();
    dual_step_.head(k) = projected_normal_.head(k);
    R_.topLeftCorner(k, k).triangularView<Eigen::Upper>().solveInPlace(dual_step_.head(k));

    // The part of the normal outside the span of the active ones is compared with the whole: rounding leaves
    // about 1e-16 of it even if the normals are dependent.
    const double free_part = projected_normal_.tail(variables - k).squaredNorm();
    const bool dependent = free_part <= 1e-22 * projected_normal_.squaredNorm();

    double largest_dual_step = kInfinity;
    int blocking = -1;
    for (int i = 0; i < k; ++i) {
      if (dual_step_[i] <= 1e-14) continue;
      const double ratio = active_multiplier_[slot(i)] / dual_step_[i];
      if (ratio < largest_dual_step) {
        largest_dual_step = ratio;
        blocking = i;
      }
    }
    const double slack = C.row(row).dot(x_) - d[row];
    const double full_step = dependent ? kInfinity : std::max(0.0, -slack / free_part);
    const double step = std::min(largest_dual_step, full_step);
    if (step == kInfinity) return QpStatus::kInfeasible;

    for (int i = 0; i < k; ++i) active_multiplier_[slot(i)] -= step * dual_step_[i];
    multiplier += step;
    if (!dependent) {
      primal_step_.noalias() = J_.rightCols(variables - k) * projected_normal_.tail(variables - k);
      x_ += step * primal_step_;
    }
    if (full_step <= largest_dual_step) {
      add_to_active_set(row, multiplier);
      return QpStatus::kSolved;
    }
    drop_from_active_set(blocking);
  }
}

void QuadraticProgram::rotate_factors(int column, double cosine, double sine) {
  for (int i = 0; i < x_.size(); ++i) {
    const double a = J_(i, column);
    const double b = J_(i, column + 1);
    J_(i, column) = cosine * a + sine * b;
    J_(i, column + 1) = cosine * b - sine * a;
  }
}

void QuadraticProgram::add_to_active_set(int row, double multiplier) {
  const int k = active_count_;
  for (auto j = static_cast<int>(x_.size()) - 2; j >= k; --j) {
    const double length = length_of(projected_normal_[j], projected_normal_[j + 1]);
    if (length == 0) continue;
    rotate_factors(j, projected_normal_[j] / length, projected_normal_[j + 1] / length);
    projected_normal_[j] = length;
    projected_normal_[j + 1] = 0;
  }
  R_.col(k).head(k + 1) = projected_normal_.head(k + 1);
  active_[slot(k)] = row;
  active_multiplier_[slot(k)] = multiplier;
  is_active_[slot(row)] = true;
  ++active_count_;
}

void QuadraticProgram::drop_from_active_set(int position) {
  is_active_[slot(active_[slot(position)])] = false;
  --active_count_;
  for (int j = position; j < active_count_; ++j) {
    active_[slot(j)] = active_[slot(j + 1)];
    active_multiplier_[slot(j)] = active_multiplier_[slot(j + 1)];
    R_.col(j) = R_.col(j + 1);
  }
  // Each moved column has one entry below the diagonal; rotations of J's columns remove it.
  for (int j = position; j < active_count_; ++j) {
    const double length = length_of(R_(j, j), R_(j + 1, j));
    if (length == 0) continue;
    const double cosine = R_(j, j) / length;
    const double sine = R_(j + 1, j) / length;
    for (int c = j; c < active_count_; ++c) {
      const double a = R_(j, c);
      const double b = R_(j + 1, c);
      R_(j, c) = cosine * a + sine * b;
      R_(j + 1, c) = cosine * b - sine * a;
    }
    rotate_factors(j, cosine, sine);
  }
}

}  // namespace walkman::motion
