#include "adaptation/motion/priority_cascade.h"

#include <Eigen/QR>

namespace walkman::motion {
namespace {

/// Pivots smaller than this fraction of the largest count as zero.
constexpr double kRankThreshold = 1e-7;
/// A level whose largest pivot is below this does not constrain the freedom that is left.
constexpr double kSmallestPivot = 1e-9;

}  // namespace

void PriorityCascade::clear(int variables) noexcept {
  variables_ = variables;
  level_count_ = 0;
}

PriorityLevel* PriorityCascade::add_level(double damping) noexcept {
  if (level_count_ == kMaxLevels) return nullptr;
  PriorityLevel& level = levels_[static_cast<std::size_t>(level_count_++)];
  level.A.resize(0, variables_);
  level.b.resize(0);
  level.damping = damping;
  return &level;
}

/// Computes C Z. Bounds on single variables, most of the rows, only pick rows of Z.
void PriorityCascade::project(const InequalityMatrix& C) {
  CZ_.resize(C.rows(), Z_.cols());
  Eigen::Index dense = C.rows();  // rows from here on are not bounds
  while (dense > 0 && only_entry_[static_cast<std::size_t>(dense - 1)] < 0) --dense;
  for (Eigen::Index row = 0; row < dense; ++row) {
    const int entry = only_entry_[static_cast<std::size_t>(row)];
    if (entry >= 0)
      CZ_.row(row) = C(row, entry) * Z_.row(entry);
    else
      CZ_.row(row).noalias() = C.row(row) * Z_;
  }
  CZ_.bottomRows(C.rows() - dense).noalias() = C.bottomRows(C.rows() - dense) * Z_;
}

QpStatus PriorityCascade::solve(const InequalityMatrix& C, const InequalityVector& d) noexcept {
  for (InequalityVector& multipliers : multipliers_) multipliers.resize(0);
  x_.setZero(variables_);
  Z_.setIdentity(variables_, variables_);
  for (Eigen::Index row = 0; row < C.rows(); ++row) {
    int entry = -1;
    int entries = 0;
    for (int i = 0; i < variables_ && entries < 2; ++i) {
      if (C(row, i) == 0) continue;
      entry = i;
      ++entries;
    }
    only_entry_[static_cast<std::size_t>(row)] = entries == 1 ? entry : -1;
  }
  for (int i = 0; i < level_count_ && Z_.cols() > 0; ++i) {
    const PriorityLevel& level = levels_[static_cast<std::size_t>(i)];
    if (i == 0) {  // x = 0, Z = 1
      AZ_ = level.A;
      residual_ = -level.b;
      CZ_ = C;
      slack_ = d;
    } else {
      AZ_.noalias() = level.A * Z_;
      residual_.noalias() = level.A * x_;
      residual_ -= level.b;
      project(C);
      slack_ = d;
      slack_.noalias() -= C * x_;
      // The preceding levels satisfy every row up to rounding. Without this, rounding could make a row look
      // violated that the remaining directions cannot correct.
      slack_ = slack_.cwiseMin(0.0);
    }
    G_.setZero(Z_.cols(), Z_.cols());
    G_.selfadjointView<Eigen::Lower>().rankUpdate(AZ_.transpose());
    G_.diagonal().array() += level.damping;
    g_.noalias() = AZ_.transpose() * residual_;
    const QpStatus status = program_.solve(G_, g_, CZ_, slack_);
    if (status != QpStatus::kSolved) {
      x_.setZero();
      return status;
    }
    multipliers_[static_cast<std::size_t>(i)] = program_.multipliers();
    x_.noalias() += Z_ * program_.x();
    if (i + 1 < level_count_) shrink_null_space();
  }
  return QpStatus::kSolved;
}

void PriorityCascade::shrink_null_space() {
  if (AZ_.rows() == 0) return;
  AZ_transposed_ = AZ_.transpose();
  Eigen::ColPivHouseholderQR<VariableMatrix> qr(AZ_transposed_.rows(), AZ_transposed_.cols());
  qr.setThreshold(kRankThreshold);
  qr.compute(AZ_transposed_);
  if (qr.maxPivot() < kSmallestPivot) return;
  qr.householderQ().applyThisOnTheRight(Z_);
  next_Z_ = Z_.rightCols(Z_.cols() - qr.rank());
  Z_ = next_Z_;
}

}  // namespace walkman::motion
