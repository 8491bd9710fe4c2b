#include "emulator/plant/dynamics/row_space_solver.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

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

/// Index of the body that an object is part of; the number of bodies if the object does not move.
std::size_t body_of(std::span<const KnownBody> bodies, const btCollisionObject& object) {
  const auto* collider = btMultiBodyLinkCollider::upcast(&object);
  if (collider == nullptr) return bodies.size();
  const auto found = std::find_if(bodies.begin(), bodies.end(), [&](const KnownBody& known) {
    return known.body == collider->m_multiBody;
  });
  return static_cast<std::size_t>(found - bodies.begin());
}

}  // namespace

inline double RowSpaceSolver::wanted(int row) const {
  return impulse_[row] + (target_[row] - velocity_[row] - impulse_[row] * softness_[row]) * inverse_[row];
}

inline std::array<double, 2> RowSpaceSolver::wanted_within(int first, int second, double limit) const {
  std::array<double, 2> impulses{wanted(first), wanted(second)};
  if (impulses[0] * impulses[0] + impulses[1] * impulses[1] <= limit * limit) return impulses;
  // The contact slides, and friction acts against the velocity. If each row were scaled by its own inertia,
  // the sweeps would converge to friction against the velocity scaled by these inertias.
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

void RowSpaceSolver::find_islands(std::span<const KnownBody> bodies,
                                  std::span<btPersistentManifold* const> manifolds) {
  island_.resize(bodies.size());
  std::iota(island_.begin(), island_.end(), std::size_t{0});
  for (const btPersistentManifold* manifold : manifolds) {
    if (manifold->getNumContacts() == 0) continue;
    const std::size_t a = body_of(bodies, *manifold->getBody0());
    const std::size_t b = body_of(bodies, *manifold->getBody1());
    if (a == bodies.size() || b == bodies.size() || island_[a] == island_[b]) continue;
    const auto [kept, joined] = std::minmax(island_[a], island_[b]);
    std::replace(island_.begin(), island_.end(), std::size_t{joined}, std::size_t{kept});
  }
}

void RowSpaceSolver::solve(std::span<const KnownBody> bodies,
                           std::span<btPersistentManifold* const> manifolds,
                           const btContactSolverInfo& info) {
  find_islands(bodies, manifolds);
  for (std::size_t island = 0; island < bodies.size(); ++island) {
    if (island_[island] != island) continue;
    island_manifolds_.clear();
    island_stops_.clear();
    for (btPersistentManifold* manifold : manifolds) {
      const std::size_t a = body_of(bodies, *manifold->getBody0());
      const std::size_t one = a < bodies.size() ? a : body_of(bodies, *manifold->getBody1());
      if (island_[one] == island) island_manifolds_.push_back(manifold);
    }
    for (const JointStop& stop : stops_) {
      const auto body = std::find_if(bodies.begin(), bodies.end(),
                                     [&](const KnownBody& known) { return known.body == &stop.body(); });
      if (island_[static_cast<std::size_t>(body - bodies.begin())] == island) island_stops_.push_back(stop);
    }
    solve_island(bodies, info);
  }
}

void RowSpaceSolver::solve_island(std::span<const KnownBody> bodies, const btContactSolverInfo& info) {
  rows_.build(bodies, island_stops_, island_manifolds_, info);
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
    impulse_[i] = row.start;
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    if (impulse_[i] != 0) add(velocity_.data(), delassus_.col(i).data(), impulse_[i], count);
  }
  for (int sweep = 0; sweep < info.m_numIterations; ++sweep) {
    const bool forward = (sweep & 1) != 0;
    const double residual =
        std::max({sweep_stops(forward), sweep_normals(), sweep_friction(), sweep_turns()});
    if (residual * residual <= info.m_leastSquaresResidualThreshold) break;
  }
  rows_.apply(impulse_, velocity_, info.m_timeStep);
}

}  // namespace walkman::plant
