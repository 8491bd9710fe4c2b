#include "emulator/plant/row_space_solver.h"

#include <algorithm>
#include <cmath>

#include <BulletDynamics/Featherstone/btMultiBody.h>

namespace walkman::plant {

bool RowSpaceSolver::can_solve(const btContactSolverInfo& info) const {
  return m_tmpSolverContactConstraintPool.size() == 0 && m_tmpSolverNonContactConstraintPool.size() == 0 &&
         m_multiBodySpinningFrictionContactConstraints.size() == 0 &&
         m_multiBodyTorsionalFrictionContactConstraints.size() == 0 &&
         (info.m_solverMode & SOLVER_USE_2_FRICTION_DIRECTIONS) != 0;
}

void RowSpaceSolver::gather(int row_count) {
  const int velocities = m_data.m_deltaVelocities.size();
  jacobian_.setZero(row_count, velocities);
  response_.setZero(row_count, velocities);
  for (Eigen::VectorXd* v : {&velocity_, &impulse_, &rhs_, &cfm_, &inverse_}) v->resize(row_count);
  for (int i = 0; i < row_count; ++i) {
    const btMultiBodySolverConstraint& row = *rows_[static_cast<std::size_t>(i)];
    const auto add = [&](const btMultiBody* body, int jacobian_index, int velocity_index) {
      const int n = body->getNumDofs() + 6;
      jacobian_.row(i).segment(velocity_index, n) +=
          Eigen::Map<const Eigen::RowVectorXd>(&m_data.m_jacobians[jacobian_index], n);
      response_.row(i).segment(velocity_index, n) +=
          Eigen::Map<const Eigen::RowVectorXd>(&m_data.m_deltaVelocitiesUnitImpulse[jacobian_index], n);
    };
    if (row.m_multiBodyA != nullptr) add(row.m_multiBodyA, row.m_jacAindex, row.m_deltaVelAindex);
    if (row.m_multiBodyB != nullptr) add(row.m_multiBodyB, row.m_jacBindex, row.m_deltaVelBindex);
    impulse_[i] = row.m_appliedImpulse;
    rhs_[i] = row.m_rhs;
    cfm_[i] = row.m_cfm;
    inverse_[i] = row.m_jacDiagABInv;
  }
  impulse0_ = impulse_;
  delassus_.resize(row_count, row_count);
  delassus_.triangularView<Eigen::Lower>() = response_ * jacobian_.transpose();
  delassus_.triangularView<Eigen::StrictlyUpper>() = delassus_.transpose();
  velocity_.noalias() =
      jacobian_ * Eigen::Map<const Eigen::VectorXd>(&m_data.m_deltaVelocities[0], velocities);
}

double RowSpaceSolver::move(int row, double delta) {
  if (delta == 0) return 0;
  impulse_[row] += delta;
  velocity_.noalias() += delassus_.col(row) * delta;
  const double change = delta / inverse_[row];
  return change * change;
}

double RowSpaceSolver::sweep_bilateral(int count, bool forward) {
  double worst = 0;
  for (int k = 0; k < count; ++k) {
    const int i = forward ? k : count - 1 - k;
    const auto& row = *rows_[static_cast<std::size_t>(i)];
    const double wanted = impulse_[i] + rhs_[i] - impulse_[i] * cfm_[i] - velocity_[i] * inverse_[i];
    const double lower = row.m_lowerLimit;
    const double upper = row.m_upperLimit;
    worst = std::max(worst, move(i, std::clamp(wanted, lower, upper) - impulse_[i]));
  }
  return worst;
}

double RowSpaceSolver::sweep_normals(int first, int count) {
  double worst = 0;
  for (int i = first; i < first + count; ++i) {
    const double wanted = impulse_[i] + rhs_[i] - impulse_[i] * cfm_[i] - velocity_[i] * inverse_[i];
    worst = std::max(worst, move(i, std::max(wanted, 0.0) - impulse_[i]));
  }
  return worst;
}

double RowSpaceSolver::sweep_friction(int first, int count, int first_normal) {
  double worst = 0;
  for (int i = first; i + 1 < first + count; i += 2) {
    const auto& row = *rows_[static_cast<std::size_t>(i)];
    const double limit = row.m_friction * impulse_[first_normal + row.m_frictionIndex];
    const int k = i + 1;
    double a = impulse_[i] + rhs_[i] - impulse_[i] * cfm_[i] - velocity_[i] * inverse_[i];
    double b = impulse_[k] + rhs_[k] - impulse_[k] * cfm_[k] - velocity_[k] * inverse_[k];
    const double norm = std::sqrt(a * a + b * b);
    if (norm > limit) {
      const double scale = norm > 0 ? limit / norm : 0;
      a *= scale;
      b *= scale;
    }
    worst = std::max({worst, move(i, a - impulse_[i]), move(k, b - impulse_[k])});
  }
  return worst;
}

void RowSpaceSolver::apply() {
  for (int i = 0; i < impulse_.size(); ++i) {
    btMultiBodySolverConstraint& row = *rows_[static_cast<std::size_t>(i)];
    const double delta = impulse_[i] - impulse0_[i];
    row.m_appliedImpulse = impulse_[i];
    if (delta == 0) continue;
    if (row.m_multiBodyA != nullptr) {
      row.m_multiBodyA->applyDeltaVeeMultiDof2(&m_data.m_deltaVelocitiesUnitImpulse[row.m_jacAindex], delta);
    }
    if (row.m_multiBodyB != nullptr) {
      row.m_multiBodyB->applyDeltaVeeMultiDof2(&m_data.m_deltaVelocitiesUnitImpulse[row.m_jacBindex], delta);
    }
  }
}

btScalar RowSpaceSolver::solveGroupCacheFriendlyIterations(
    btCollisionObject** bodies, int body_count, btPersistentManifold** manifolds, int manifold_count,
    btTypedConstraint** constraints, int constraint_count, const btContactSolverInfo& info,
    btIDebugDraw* drawer) {
  if (!can_solve(info)) {
    ++fallbacks_;
    return btMultiBodyConstraintSolver::solveGroupCacheFriendlyIterations(
        bodies, body_count, manifolds, manifold_count, constraints, constraint_count, info, drawer);
  }
  const int bilateral = m_multiBodyNonContactConstraints.size();
  const int normals = m_multiBodyNormalContactConstraints.size();
  const int friction = m_multiBodyFrictionContactConstraints.size();
  const int row_count = bilateral + normals + friction;
  if (row_count == 0) return 0;
  rows_.clear();
  for (int i = 0; i < bilateral; ++i) rows_.push_back(&m_multiBodyNonContactConstraints[i]);
  for (int i = 0; i < normals; ++i) rows_.push_back(&m_multiBodyNormalContactConstraints[i]);
  for (int i = 0; i < friction; ++i) rows_.push_back(&m_multiBodyFrictionContactConstraints[i]);
  gather(row_count);
  double residual = 0;
  for (int iteration = 0; iteration < info.m_numIterations; ++iteration) {
    residual = std::max({sweep_bilateral(bilateral, (iteration & 1) != 0), sweep_normals(bilateral, normals),
                         sweep_friction(bilateral + normals, friction, bilateral)});
    if (residual <= info.m_leastSquaresResidualThreshold) break;
  }
  apply();
  return residual;
}

btScalar RowSpaceSolver::solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int body_count,
                                                       const btContactSolverInfo& info) {
  for (int i = 0; i < m_multiBodySpinningFrictionContactConstraints.size(); ++i) {
    writeBackSolverBodyToMultiBody(m_multiBodySpinningFrictionContactConstraints[i], info.m_timeStep);
  }
  for (int i = 0; i < m_multiBodyTorsionalFrictionContactConstraints.size(); ++i) {
    writeBackSolverBodyToMultiBody(m_multiBodyTorsionalFrictionContactConstraints[i], info.m_timeStep);
  }
  return btMultiBodyConstraintSolver::solveGroupCacheFriendlyFinish(bodies, body_count, info);
}

}  // namespace walkman::plant
