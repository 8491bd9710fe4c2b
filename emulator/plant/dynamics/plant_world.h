#pragma once

#include <map>
#include <vector>

#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include "emulator/plant/dynamics/mid_step_velocity.h"

namespace walkman::plant {

/// Measures something of one multibody inside every step.
class StepProbe {
 public:
  StepProbe() = default;
  virtual ~StepProbe() = default;
  StepProbe(const StepProbe&) = delete;
  StepProbe& operator=(const StepProbe&) = delete;

  [[nodiscard]] virtual const btMultiBody& body() const = 0;
  /// Called when the step's velocities and contact forces are known and its poses are still those of its
  /// start. `before`: generalised velocity at the start of the step (the body holds that of its end); `dt` in
  /// s, `gravity` in W, m/s².
  virtual void measure(const std::vector<double>& before, double dt, const btVector3& gravity) = 0;
};

/// Bullet's multibody world with probes that measure inside the step. What moves in it are multibodies with
/// contacts; whoever adds a moving rigid body or one of Bullet's constraints gets a std::logic_error, as
/// RowSpaceSolver would pass over them.
class PlantWorld : public btMultiBodyDynamicsWorld {
 public:
  PlantWorld(btDispatcher* dispatcher, btBroadphaseInterface* broadphase, btMultiBodyConstraintSolver* solver,
             btCollisionConfiguration* configuration);

  /// The probe must outlive the world's last step.
  void add_probe(StepProbe& probe) { probes_.push_back(&probe); }
  /// From now on velocity terms are those of the poses' own instant (MidStepVelocity).
  void use_mid_step_velocities() { mid_step_ = true; }
  void removeMultiBody(btMultiBody* body) override;
  void addRigidBody(btRigidBody* body) override;
  void addRigidBody(btRigidBody* body, int group, int mask) override;
  void addConstraint(btTypedConstraint* constraint, bool collisions_off) override;
  void addMultiBodyConstraint(btMultiBodyConstraint* constraint) override;

 protected:
  void solveExternalForces(btContactSolverInfo& info) override;
  void integrateTransforms(btScalar dt) override;

 private:
  std::vector<StepProbe*> probes_;
  std::map<const btMultiBody*, std::vector<double>> velocity_before_;
  bool mid_step_ = false;
  std::map<const btMultiBody*, MidStepVelocity> mid_step_velocity_;
};

}  // namespace walkman::plant
