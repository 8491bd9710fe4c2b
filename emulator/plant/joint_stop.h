#pragma once

#include <BulletDynamics/Featherstone/btMultiBodyConstraint.h>

namespace walkman::plant {

/// The two hard stops of a joint: one-sided, without bounce, as rows of the solver, so that any torque is
/// held without the give (and the limit on the step) of a spring.
///
/// The rows' reaction is torque inside the mechanism, on the link and its parent alike. It stays out of
/// Bullet's applied constraint forces, which wrenches count as load from outside.
class JointStop : public btMultiBodyConstraint {
 public:
  /// Of the joint that carries `link` (Bullet's index), which may be from `lower` to `upper`, rad or m.
  JointStop(btMultiBody& body, int link, double lower, double upper);

  void finalizeMultiDof() override;
  [[nodiscard]] int getIslandIdA() const override;
  [[nodiscard]] int getIslandIdB() const override { return getIslandIdA(); }
  void createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                            const btContactSolverInfo& info) override;
  void debugDraw(btIDebugDraw* /*drawer*/) override {}

 private:
  double lower_, upper_;
};

}  // namespace walkman::plant
