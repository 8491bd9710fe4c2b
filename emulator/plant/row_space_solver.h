#pragma once

#include <vector>

#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <Eigen/Core>

namespace walkman::plant {

/// Projected Gauss–Seidel over the rows' own space.
///
/// Bullet's stock solver keeps one velocity vector as long as all degrees of freedom and touches it twice for
/// each row and sweep. Here W = J M⁻¹ Jᵀ is formed once and the sweeps run on W alone, in the stock solver's
/// row order and with its limits; the friction cone is exact (both tangential impulses scaled together). The
/// impulses go back to the multibodies once at the end.
///
/// Rows it does not know (rigid bodies that move, one friction direction) fall back to the stock solver.
/// Spinning and rolling friction is written back to the links' applied constraint torques, which Bullet 3.24
/// forgets, so that a wrench computed from them is complete.
class RowSpaceSolver : public btMultiBodyConstraintSolver {
 public:
  [[nodiscard]] long fallbacks() const { return fallbacks_; }

  btScalar solveGroupCacheFriendlyIterations(btCollisionObject** bodies, int body_count,
                                             btPersistentManifold** manifolds, int manifold_count,
                                             btTypedConstraint** constraints, int constraint_count,
                                             const btContactSolverInfo& info, btIDebugDraw* drawer) override;
  btScalar solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int body_count,
                                         const btContactSolverInfo& info) override;

 private:
  [[nodiscard]] bool can_solve(const btContactSolverInfo& info) const;
  void gather(int row_count);
  double sweep_bilateral(int count, bool forward);
  double sweep_normals(int first, int count);
  double sweep_friction(int first, int count, int first_normal);
  void apply();
  /// Moves row `row` by `delta` and returns the squared velocity it changed by.
  double move(int row, double delta);

  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  std::vector<btMultiBodySolverConstraint*> rows_;
  RowMajor jacobian_, response_;  // rows × velocities: J and J M⁻¹
  Eigen::MatrixXd delassus_;      // W
  Eigen::VectorXd velocity_;      // J v of each row, with the impulses so far
  Eigen::VectorXd impulse_, impulse0_, rhs_, cfm_, inverse_;
  long fallbacks_ = 0;
};

}  // namespace walkman::plant
