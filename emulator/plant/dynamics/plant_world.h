#pragma once

#include <memory>
#include <vector>

#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include "emulator/plant/dynamics/forward_dynamics.h"
#include "emulator/plant/dynamics/row_space_solver.h"

namespace walkman::plant {

/// Measures something about one multibody within every step.
class StepProbe {
 public:
  StepProbe() = default;
  virtual ~StepProbe() = default;
  StepProbe(const StepProbe&) = delete;
  StepProbe& operator=(const StepProbe&) = delete;

  [[nodiscard]] virtual const btMultiBody& body() const = 0;
  /// Called when the step's velocities and contact forces are known but the poses are still those at its
  /// start. `before`: generalised velocity at the start of the step (the body holds that at its end); `dt` in
  /// s, `gravity` in W, m/s².
  virtual void measure(const std::vector<double>& before, double dt, const btVector3& gravity) = 0;
};

/// A multibody of the world, its dynamics, and its velocity at the start of the step.
struct MovingBody {
  btMultiBody* body;
  ForwardDynamics dynamics;
  std::vector<double> velocity_before;
};

/// Bullet's multibody world with its own forward dynamics and contact solver, which share the factorised
/// inertia, and with probes that measure within the step. Only multibodies with contacts move in it; adding a
/// moving rigid body or one of Bullet's constraints throws std::logic_error, because RowSpaceSolver would
/// ignore it. Nothing sleeps, so there are no islands.
class PlantWorld : public btMultiBodyDynamicsWorld {
 public:
  PlantWorld(btDispatcher* dispatcher, btBroadphaseInterface* broadphase, RowSpaceSolver* solver,
             btCollisionConfiguration* configuration);

  /// The probe must outlive the world's last step.
  void add_probe(StepProbe& probe) { probes_.push_back(&probe); }
  /// Evaluates velocity terms at the instant of the poses from now on (ForwardDynamics::VelocityTerms).
  void use_mid_step_velocities() { terms_ = ForwardDynamics::VelocityTerms::kMiddle; }
  void addMultiBody(btMultiBody* body, int group = btBroadphaseProxy::DefaultFilter,
                    int mask = btBroadphaseProxy::AllFilter) override;
  void removeMultiBody(btMultiBody* body) override;
  void addRigidBody(btRigidBody* body) override;
  void addRigidBody(btRigidBody* body, int group, int mask) override;
  void addConstraint(btTypedConstraint* constraint, bool collisions_off) override;
  void addMultiBodyConstraint(btMultiBodyConstraint* constraint) override;

 protected:
  /// Would predict unconstrained poses: needed only by moving rigid bodies, and for pictures between steps.
  void predictUnconstraintMotion(btScalar /*dt*/) override {}
  void calculateSimulationIslands() override {}
  void updateActivationState(btScalar /*dt*/) override {}
  void solveConstraints(btContactSolverInfo& info) override;
  void integrateTransforms(btScalar dt) override;

 private:
  btMultiBodyConstraintSolver unused_;  // Bullet's world requires one
  RowSpaceSolver& solver_;
  std::vector<StepProbe*> probes_;
  std::vector<std::unique_ptr<MovingBody>> moving_;  // one per Bullet multibody
  std::vector<KnownBody> known_;                     // the same
  ForwardDynamics::VelocityTerms terms_ = ForwardDynamics::VelocityTerms::kStart;
};

}  // namespace walkman::plant
