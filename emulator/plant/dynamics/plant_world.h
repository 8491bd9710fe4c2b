#pragma once

#include <map>
#include <vector>

#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include "emulator/plant/probes/inertial_probe.h"
#include "emulator/plant/dynamics/mid_step_velocity.h"
#include "emulator/plant/probes/wrench_probe.h"

namespace walkman::plant {

/// Bullet's multibody world with probes that measure inside the step. What moves in it are multibodies with
/// contacts; whoever adds a moving rigid body or one of Bullet's constraints gets a std::logic_error, as
/// RowSpaceSolver would pass over them.
class PlantWorld : public btMultiBodyDynamicsWorld {
 public:
  PlantWorld(btDispatcher* dispatcher, btBroadphaseInterface* broadphase, btMultiBodyConstraintSolver* solver,
             btCollisionConfiguration* configuration);

  void add_probe(WrenchProbe& probe) { probes_.push_back(&probe); }
  void add_probe(InertialProbe& probe) { inertial_probes_.push_back(&probe); }
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
  std::vector<WrenchProbe*> probes_;
  std::vector<InertialProbe*> inertial_probes_;
  std::map<const btMultiBody*, std::vector<double>> velocity_before_;
  bool mid_step_ = false;
  std::map<const btMultiBody*, MidStepVelocity> mid_step_velocity_;
};

}  // namespace walkman::plant
