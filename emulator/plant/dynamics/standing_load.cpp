#include "emulator/plant/dynamics/standing_load.h"

#include <algorithm>

namespace walkman::plant {
namespace {

/// A weight or a ground force at a point, on one link.
struct Load {
  int link;
  btVector3 force, point;
};

btVector3 centre_of_mass(const btMultiBody& mb) {
  btVector3 moment = mb.getBaseMass() * mb.getBasePos();
  double mass = mb.getBaseMass();
  for (int i = 0; i < mb.getNumLinks(); ++i) {
    moment += mb.getLinkMass(i) * mb.getLink(i).m_cachedWorldTransform.getOrigin();
    mass += mb.getLinkMass(i);
  }
  return moment / mass;
}

double total_mass(const btMultiBody& mb) {
  double mass = mb.getBaseMass();
  for (int i = 0; i < mb.getNumLinks(); ++i) mass += mb.getLinkMass(i);
  return mass;
}

std::vector<Load> ground_loads(const btMultiBody& mb, const std::vector<int>& feet, double gravity) {
  if (feet.size() != 2) return {};
  const auto level = [](btVector3 v) { return btVector3(v.x(), v.y(), 0); };
  const btVector3 com = level(centre_of_mass(mb));
  const btVector3 a = level(mb.getLink(feet[0]).m_cachedWorldTransform.getOrigin());
  const btVector3 b = level(mb.getLink(feet[1]).m_cachedWorldTransform.getOrigin());
  const double share = std::clamp((com - a).dot(b - a) / (b - a).length2(), 0.0, 1.0);
  const btVector3 ahead = com - (a + share * (b - a));
  const btVector3 weight(0, 0, total_mass(mb) * gravity);
  return {{feet[0], (1 - share) * weight, a + ahead}, {feet[1], share * weight, b + ahead}};
}

bool carries(const btMultiBody& mb, int joint, int link) {
  while (link > joint) link = mb.getParent(link);
  return link == joint;
}

}  // namespace

std::vector<double> holding_torques(const Multibody& body, const std::vector<int>& feet, double gravity) {
  const btMultiBody& mb = body.bullet();
  std::vector<Load> loads = ground_loads(mb, feet, gravity);
  for (int i = 0; i < mb.getNumLinks(); ++i) {
    loads.push_back(
        {i, btVector3(0, 0, -gravity * mb.getLinkMass(i)), mb.getLink(i).m_cachedWorldTransform.getOrigin()});
  }
  std::vector<double> torques(static_cast<std::size_t>(mb.getNumLinks()), 0.0);
  for (int i = 0; i < mb.getNumLinks(); ++i) {
    const btMultibodyLink& joint = mb.getLink(i);
    const btMatrix3x3& R = joint.m_cachedWorldTransform.getBasis();
    const btVector3 pivot = joint.m_cachedWorldTransform.getOrigin() - R * joint.m_dVector;
    const btVector3 axis = R * joint.m_axes[0].m_topVec;
    for (const Load& load : loads) {
      if (!carries(mb, i, load.link)) continue;
      torques[static_cast<std::size_t>(i)] -= axis.dot((load.point - pivot).cross(load.force));
    }
  }
  return torques;
}

}  // namespace walkman::plant
