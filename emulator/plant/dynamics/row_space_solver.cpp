#include "emulator/plant/dynamics/row_space_solver.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace walkman::plant {
namespace {

constexpr double kImmovable = 1e-15;  // 1/kg: a held base against a wall; no impulse moves the two apart

void add(double* __restrict sum, const double* __restrict a, double times_a, std::ptrdiff_t count) {
  for (std::ptrdiff_t i = 0; i < count; ++i) sum[i] += a[i] * times_a;
}

void add(double* __restrict sum, const double* __restrict a, double times_a, const double* __restrict b,
         double times_b, std::ptrdiff_t count) {
  for (std::ptrdiff_t i = 0; i < count; ++i) sum[i] += a[i] * times_a + b[i] * times_b;
}

}  // namespace

inline double RowSpaceSolver::wanted(int row) const {
  return impulse_[row] + (target_[row] - velocity_[row] - impulse_[row] * softness_[row]) * inverse_[row];
}

inline std::array<double, 2> RowSpaceSolver::wanted_within(int first, int second, double limit) const {
  std::array<double, 2> impulses{wanted(first), wanted(second)};
  if (impulses[0] * impulses[0] + impulses[1] * impulses[1] <= limit * limit) return impulses;
  // It slides, and friction acts against the velocity. Were each row scaled by its own inertia, it would act
  // against the velocity as scaled by these, where the sweeps converge.
  const double scale = std::min(inverse_[first], inverse_[second]);
  for (int i = 0; i < 2; ++i) {
    const int row = i == 0 ? first : second;
    impulses[static_cast<std::size_t>(i)] =
        impulse_[row] + (target_[row] - velocity_[row] - impulse_[row] * softness_[row]) * scale;
  }
  const double norm = std::sqrt(impulses[0] * impulses[0] + impulses[1] * impulses[1]);
  if (norm > limit) {
    for (double& impulse : impulses) impulse *= limit / norm;
  }
  return impulses;
}

inline double RowSpaceSolver::move(int row, double impulse) {
  const double delta = impulse - impulse_[row];
  if (delta == 0) return 0;
  impulse_[row] = impulse;
  add(velocity_.data(), delassus_.col(row).data(), delta, velocity_.size());
  return std::abs(delta) * diagonal_[row];
}

WALKMAN_WIDE_VECTORS double RowSpaceSolver::sweep_stops(bool forward) {
  double worst = 0;
  const int count = rows_.stop_count();
  for (int k = 0; k < count; ++k) {
    const int i = forward ? k : count - 1 - k;
    worst = std::max(worst, move(i, std::max(wanted(i), 0.0)));
  }
  return worst;
}

WALKMAN_WIDE_VECTORS double RowSpaceSolver::sweep_normals() {
  double worst = 0;
  const int end = rows_.stop_count() + kContactRows * static_cast<int>(rows_.contacts().size());
  for (int i = rows_.stop_count(); i < end; i += kContactRows)
    worst = std::max(worst, move(i, std::max(wanted(i), 0.0)));
  return worst;
}

WALKMAN_WIDE_VECTORS double RowSpaceSolver::sweep_friction() {
  double worst = 0;
  int normal = rows_.stop_count();
  for (const ContactRow& contact : rows_.contacts()) {
    const double limit = contact.friction * impulse_[normal];
    const int i = normal + 1;
    const int k = normal + 2;
    normal += kContactRows;
    if (limit == 0 && impulse_[i] == 0 && impulse_[k] == 0) continue;
    const auto [a, b] = wanted_within(i, k, limit);
    const double change_a = a - impulse_[i];
    const double change_b = b - impulse_[k];
    impulse_[i] = a;
    impulse_[k] = b;
    add(velocity_.data(), delassus_.col(i).data(), change_a, delassus_.col(k).data(), change_b,
        velocity_.size());
    worst = std::max({worst, std::abs(change_a) * diagonal_[i], std::abs(change_b) * diagonal_[k]});
  }
  return worst;
}

WALKMAN_WIDE_VECTORS double RowSpaceSolver::sweep_turns() {
  double worst = 0;
  for (const TurnRow& turn : rows_.turns()) {
    const double normal = impulse_[rows_.stop_count() + kContactRows * turn.contact];
    const double spin = turn.spinning * normal;
    worst = std::max(worst, move(turn.row, std::clamp(wanted(turn.row), -spin, spin)));
    const auto [a, b] = wanted_within(turn.row + 1, turn.row + 2, turn.rolling * normal);
    worst = std::max({worst, move(turn.row + 1, a), move(turn.row + 2, b)});
  }
  return worst;
}

void RowSpaceSolver::solve(std::span<const KnownBody> bodies,
                           std::span<btPersistentManifold* const> manifolds,
                           const btContactSolverInfo& info) {
  rows_.build(bodies, stops_, manifolds, info);
  const auto count = static_cast<Eigen::Index>(rows_.rows().size());
  if (count == 0) return;
  rows_.delassus(delassus_);
  for (Eigen::VectorXd* v : {&velocity_, &impulse_, &target_, &softness_, &diagonal_, &inverse_})
    v->resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Row& row = rows_.rows()[static_cast<std::size_t>(i)];
    velocity_[i] = row.velocity;
    target_[i] = row.target;
    softness_[i] = row.softness;
    diagonal_[i] = delassus_(i, i) + row.softness;
    inverse_[i] = diagonal_[i] > kImmovable ? 1 / diagonal_[i] : 0;
  }
  impulse_.setZero();
  for (int sweep = 0; sweep < info.m_numIterations; ++sweep) {
    const bool forward = (sweep & 1) != 0;
    const double residual =
        std::max({sweep_stops(forward), sweep_normals(), sweep_friction(), sweep_turns()});
    if (residual * residual <= info.m_leastSquaresResidualThreshold) break;
  }
  rows_.apply(impulse_, velocity_, info.m_timeStep);
}

}  // namespace walkman::plant
