#include "emulator/plant/dynamics/plant_world.h"

#include <limits>
#include <stdexcept>

namespace walkman::plant {
namespace {

void require_static(const btRigidBody& body) {
  if (!body.isStaticObject())
    throw std::logic_error("a rigid body that moves: PlantWorld has multibodies only");
}

[[noreturn]] void refuse_constraint() {
  throw std::logic_error("one of Bullet's constraints: PlantWorld has contacts and joint stops only");
}

}  // namespace

PlantWorld::PlantWorld(btDispatcher* dispatcher, btBroadphaseInterface* broadphase,
                       btMultiBodyConstraintSolver* solver, btCollisionConfiguration* configuration)
    : btMultiBodyDynamicsWorld(dispatcher, broadphase, solver, configuration) {
  // All contacts of a step in one call of the solver, however many: a second call would push every stop
  // twice.
  getSolverInfo().m_minimumSolverBatchSize = std::numeric_limits<int>::max();
}

void PlantWorld::addRigidBody(btRigidBody* body) {
  require_static(*body);
  btMultiBodyDynamicsWorld::addRigidBody(body);
}

void PlantWorld::addRigidBody(btRigidBody* body, int group, int mask) {
  require_static(*body);
  btMultiBodyDynamicsWorld::addRigidBody(body, group, mask);
}

void PlantWorld::addConstraint(btTypedConstraint* /*constraint*/, bool /*collisions_off*/) {
  refuse_constraint();
}

void PlantWorld::addMultiBodyConstraint(btMultiBodyConstraint* /*constraint*/) { refuse_constraint(); }

void PlantWorld::removeMultiBody(btMultiBody* body) {
  velocity_before_.erase(body);
  mid_step_velocity_.erase(body);
  btMultiBodyDynamicsWorld::removeMultiBody(body);
}

void PlantWorld::solveExternalForces(btContactSolverInfo& info) {
  for (int i = 0; i < m_multiBodies.size(); ++i) {
    btMultiBody* mb = m_multiBodies[i];
    velocity_before_[mb].assign(mb->getVelocityVector(), mb->getVelocityVector() + 6 + mb->getNumDofs());
    if (mid_step_) mid_step_velocity_[mb].predict(*mb, info.m_timeStep);
  }
  btMultiBodyDynamicsWorld::solveExternalForces(info);
  if (!mid_step_) return;
  for (int i = 0; i < m_multiBodies.size(); ++i)
    mid_step_velocity_[m_multiBodies[i]].correct(*m_multiBodies[i]);
}

void PlantWorld::integrateTransforms(btScalar dt) {
  for (StepProbe* probe : probes_) probe->measure(velocity_before_[&probe->body()], dt, getGravity());
  btMultiBodyDynamicsWorld::integrateTransforms(dt);
}

}  // namespace walkman::plant
