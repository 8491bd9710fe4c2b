#include "emulator/plant/dynamics/forward_dynamics.h"

namespace walkman::plant {
void ForwardDynamics::take_forces(const btMultiBody& body) {
  const auto count = static_cast<std::size_t>(body.getNumLinks()) + 1;
  applied_.resize(count);
  applied_[0] = {body.getBaseTorque(), body.getBaseForce()};  // the base's centre of mass is the origin
  for (int i = 0; i < body.getNumLinks(); ++i) {
    const btVector3 arm = body.getLink(i).m_cachedWorldTransform.getOrigin() - inertia_.origin();
    const btVector3& force = body.getLinkForce(i);
    applied_[static_cast<std::size_t>(i) + 1] = {body.getLinkTorque(i) + arm.cross(force), force};
  }
}

void ForwardDynamics::accelerate(const btMultiBody& body, const std::vector<double>& velocity) {
  const std::vector<Spatial>& axes = inertia_.axes();
  const std::vector<JointSpaceInertia::Composite>& bodies = inertia_.bodies();
  const std::size_t count = bodies.size();
  motion_.resize(count);
  bias_.resize(count);
  // Spatial acceleration with all generalised accelerations zero, then the force it requires.
  const auto force_of = [&](std::size_t i, const Spatial& acceleration) {
    const Spatial& v = motion_[i];
    const Spatial momentum = bodies[i].times(v);
    Spatial force = bodies[i].times(acceleration);
    force.angular += v.angular.cross(momentum.angular) + v.linear.cross(momentum.linear);
    force.linear += v.angular.cross(momentum.linear);
    return Spatial{force.angular - applied_[i].angular, force.linear - applied_[i].linear};
  };
  spatial_.resize(count);
  const bool fixed = body.hasFixedBase();
  motion_[0] =
      fixed ? Spatial{}
            : Spatial{{velocity[0], velocity[1], velocity[2]}, {velocity[3], velocity[4], velocity[5]}};
  // The centre of mass does not accelerate; the spatial acceleration refers to the point in space where it is
  // now, which another body point reaches next.
  spatial_[0] = {{0, 0, 0}, motion_[0].linear.cross(motion_[0].angular)};
  bias_[0] = force_of(0, spatial_[0]);
  for (int i = 0; i < body.getNumLinks(); ++i) {
    const btMultibodyLink& link = body.getLink(i);
    const auto own = static_cast<std::size_t>(i) + 1;
    const auto parent = static_cast<std::size_t>(link.m_parent) + 1;
    motion_[own] = motion_[parent];
    spatial_[own] = spatial_[parent];
    for (int d = 0; d < link.m_dofCount; ++d) {
      const auto v = static_cast<std::size_t>(JointSpaceInertia::kBaseVelocities + link.m_dofOffset + d);
      const btVector3 w = axes[v].angular * velocity[v];
      const btVector3 u = axes[v].linear * velocity[v];
      motion_[own].angular += w;
      motion_[own].linear += u;
      const Spatial& m = motion_[own];
      spatial_[own].angular += m.angular.cross(w);
      spatial_[own].linear += m.angular.cross(u) + m.linear.cross(w);
    }
    bias_[own] = force_of(own, spatial_[own]);
  }
  acceleration_.assign(velocity.size(), 0);
  for (int i = body.getNumLinks() - 1; i >= 0; --i) {
    const btMultibodyLink& link = body.getLink(i);
    const Spatial& force = bias_[static_cast<std::size_t>(i) + 1];
    for (int d = 0; d < link.m_dofCount; ++d) {
      const auto v = static_cast<std::size_t>(JointSpaceInertia::kBaseVelocities + link.m_dofOffset + d);
      acceleration_[v] =
          link.m_jointTorque[d] - axes[v].angular.dot(force.angular) - axes[v].linear.dot(force.linear);
    }
    Spatial& carrier = bias_[static_cast<std::size_t>(link.m_parent) + 1];
    carrier.angular += force.angular;
    carrier.linear += force.linear;
  }
  if (!fixed) {
    for (int k = 0; k < 3; ++k) {
      acceleration_[static_cast<std::size_t>(k)] = -bias_[0].angular[k];
      acceleration_[static_cast<std::size_t>(k) + 3] = -bias_[0].linear[k];
    }
  }
  inertia_.solve(acceleration_);
}

void ForwardDynamics::advance(btMultiBody& body, double dt, VelocityTerms terms) {
  inertia_.update(body);
  take_forces(body);
  const auto count = static_cast<std::size_t>(JointSpaceInertia::kBaseVelocities + body.getNumDofs());
  start_.assign(body.getVelocityVector(), body.getVelocityVector() + count);
  accelerate(body, start_);
  if (terms == VelocityTerms::kMiddle) {
    middle_ = start_;
    for (std::size_t v = 0; v < count; ++v) middle_[v] += acceleration_[v] * dt / 2;
    accelerate(body, middle_);
  }
  body.applyDeltaVeeMultiDof(acceleration_.data(), dt);
}

}  // namespace walkman::plant
