#include "emulator/plant/actuators/spindle.h"

#include <algorithm>
#include <cmath>

namespace walkman::plant {
namespace {

// The controller's natural frequency, well below what steps of 1 ms resolve and above what a turning laser
// needs.
constexpr double kFrequency = 100;   // rad/s
constexpr double kMostTorque = 0.3;  // N·m, of a small geared motor; holds the laser (0.6 N) in any posture
constexpr double kMostLag = 0.2;     // rad, by which the commanded angle may lead the true one

}  // namespace

Spindle::Spindle(btMultiBody& body, int link, double damping) : body_(body), link_(link), damping_(damping) {
  const btMultibodyLink& joint = body.getLink(link);
  const btVector3 axis = joint.getAxisTop(0);
  // The axis passes through the joint; the inertia is about the centre of mass.
  const btVector3 lever = axis.cross(joint.m_dVector);
  inertia_ = (axis * axis).dot(joint.m_inertiaLocal) + joint.m_mass * lever.length2();
  angle_ = body.getJointPos(link);
}

void Spindle::turn(double rate) { rate_ = std::clamp(rate, -kMostRate, kMostRate); }

void Spindle::apply(double dt) {
  const double at = body_.getJointPos(link_), speed = body_.getJointVel(link_);
  angle_ = std::clamp(angle_ + rate_ * dt, at - kMostLag, at + kMostLag);
  const double wanted =
      inertia_ * (kFrequency * kFrequency * (angle_ - at) + 2 * kFrequency * (rate_ - speed)) +
      damping_ * rate_;
  body_.addJointTorque(link_, std::clamp(wanted, -kMostTorque, kMostTorque) - damping_ * speed);
}

}  // namespace walkman::plant
