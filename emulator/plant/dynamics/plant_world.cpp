#include "emulator/plant/dynamics/plant_world.h"

#include <algorithm>
#include <stdexcept>

namespace walkman::plant {
namespace {

void require_static(const btRigidBody& body) {
  if (!body.isStaticObject())
    throw std::logic_error("a moving rigid body: PlantWorld supports multibodies only");
}

[[noreturn]] void refuse_constraint() {
  throw std::logic_error("a Bullet constraint: PlantWorld supports contacts and joint stops only");
}

}  // namespace

PlantWorld::PlantWorld(btDispatcher* dispatcher, btBroadphaseInterface* broadphase, RowSpaceSolver* solver,
                       btCollisionConfiguration* configuration)
    : btMultiBodyDynamicsWorld(dispatcher, broadphase, &unused_, configuration), solver_(*solver) {}

void PlantWorld::addMultiBody(btMultiBody* body, int group, int mask) {
  btMultiBodyDynamicsWorld::addMultiBody(body, group, mask);
  moving_.push_back(std::make_unique<MovingBody>());
  moving_.back()->body = body;
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
  std::erase_if(moving_, [&](const auto& moving) { return moving->body == body; });
  btMultiBodyDynamicsWorld::removeMultiBody(body);
}

void PlantWorld::solveConstraints(btContactSolverInfo& info) {
  forwardKinematics();
  clearMultiBodyConstraintForces();
  known_.clear();
  for (const auto& moving : moving_) {
    btMultiBody& body = *moving->body;
    moving->velocity_before.assign(body.getVelocityVector(),
                                   body.getVelocityVector() + 6 + body.getNumDofs());
    moving->dynamics.advance(body, info.m_timeStep, terms_);
    known_.push_back({&body, &moving->dynamics.inertia()});
  }
  btDispatcher& dispatcher = *getDispatcher();
  solver_.solve(
      known_,
      {dispatcher.getInternalManifoldPointer(), static_cast<std::size_t>(dispatcher.getNumManifolds())},
      info);
}

void PlantWorld::integrateTransforms(btScalar dt) {
  for (StepProbe* probe : probes_) {
    const auto moving = std::find_if(moving_.begin(), moving_.end(),
                                     [&](const auto& m) { return m->body == &probe->body(); });
    probe->measure((*moving)->velocity_before, dt, getGravity());
  }
  btMultiBodyDynamicsWorld::integrateTransforms(dt);
}

}  // namespace walkman::plant
