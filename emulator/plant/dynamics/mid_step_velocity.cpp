#include "emulator/plant/dynamics/mid_step_velocity.h"

namespace walkman::plant {

void MidStepVelocity::set_velocity(btMultiBody& body, const std::vector<double>& velocity) {
  if (!body.hasFixedBase()) {
    body.setBaseOmega(btVector3(velocity[0], velocity[1], velocity[2]));
    body.setBaseVel(btVector3(velocity[3], velocity[4], velocity[5]));
  }
  for (int i = 0; i < body.getNumLinks(); ++i) {
    const btMultibodyLink& link = body.getLink(i);
    if (link.m_dofCount > 0)
      body.setJointVel(i, velocity[std::size_t{6} + static_cast<std::size_t>(link.m_dofOffset)]);
  }
}

void MidStepVelocity::predict(btMultiBody& body, double dt) {
  const auto count = std::size_t{6} + static_cast<std::size_t>(body.getNumDofs());
  start_.assign(body.getVelocityVector(), body.getVelocityVector() + count);
  body.computeAccelerationsArticulatedBodyAlgorithmMultiDof(dt / 2, r_, v_, m_, false, false, false);
  middle_.assign(body.getVelocityVector(), body.getVelocityVector() + count);
}

void MidStepVelocity::correct(btMultiBody& body) {
  const btScalar* after = body.getVelocityVector();
  for (std::size_t i = 0; i < start_.size(); ++i) start_[i] += after[i] - middle_[i];
  set_velocity(body, start_);
}

}  // namespace walkman::plant
