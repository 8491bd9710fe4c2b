#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "emulator/plant/dynamics/constraint_rows.h"

namespace walkman::plant {

/// Projected Gauss–Seidel in the space of the rows, for worlds where only multibodies move.
///
/// Bullet's stock solver runs the articulated-body recursion over the whole tree once per row, then keeps one
/// velocity vector over all degrees of freedom and accesses it twice per row and sweep. Here W = J H⁻¹ Jᵀ
/// comes from a factorised H along the links' own paths, and the sweeps run on W alone, in the stock solver's
/// row order; the friction cone is exact (both tangential impulses scaled together), and a sticking contact
/// stays where it stuck (Stick). Bodies connected by contacts are swept separately from all others. A soft
/// contact that stuck starts from its impulse of the previous step, because its springs leave only one
/// solution. All others start from zero: with kept impulses, friction could hold a wedged object far beyond
/// what the normal forces of a grip explain.
///
/// PlantWorld calls it once per step with all contacts. Bullet's own constraints and moving rigid bodies,
/// which PlantWorld rejects, are not supported here.
class RowSpaceSolver {
 public:
  /// The stop's body must exist for as long as the world is stepped.
  void add_stop(const JointStop& stop) { stops_.push_back(stop); }

  /// Gives the bodies the velocities that stops and contacts allow. `bodies`: all moving bodies, with the
  /// velocities they would have without stops and contacts.
  void solve(std::span<const KnownBody> bodies, std::span<btPersistentManifold* const> manifolds,
             const btContactSolverInfo& info);

 private:
  void find_islands(std::span<const KnownBody> bodies, std::span<btPersistentManifold* const> manifolds);
  void solve_island(std::span<const KnownBody> bodies, const btContactSolverInfo& info);
  double sweep_stops(bool forward);
  double sweep_normals();
  double sweep_friction();
  double sweep_turns();
  /// Impulse that would bring row `row` to its target, before any limit.
  [[nodiscard]] double wanted(int row) const;
  /// The same for two perpendicular rows, whose combined impulse may not exceed `limit`.
  [[nodiscard]] std::array<double, 2> wanted_within(int first, int second, double limit) const;
  /// Gives row `row` the impulse `impulse` and returns the residual it had.
  double move(int row, double impulse);

  std::vector<JointStop> stops_;
  std::vector<std::size_t> island_;  // of each body: the first body that it is connected to by contacts
  std::vector<btPersistentManifold*> island_manifolds_;
  std::vector<JointStop> island_stops_;
  ConstraintRows rows_;
  Eigen::MatrixXd delassus_;  // W
  Eigen::VectorXd velocity_;  // J v of each row, with the impulses so far
  Eigen::VectorXd impulse_, target_, softness_, diagonal_, inverse_;
};

}  // namespace walkman::plant
