#include "emulator/plant/joint_stop.h"

#include <algorithm>
#include <array>

#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

namespace walkman::plant {
namespace {

constexpr double kUnlimited = 1e10;

}  // namespace

JointStop::JointStop(btMultiBody& body, int link, double lower, double upper)
    : btMultiBodyConstraint(&body, &body, link, body.getLink(link).m_parent, 2, true,
                            MULTIBODY_CONSTRAINT_LIMIT),
      lower_(lower),
      upper_(upper) {
  m_maxAppliedImpulse = kUnlimited;
}

void JointStop::finalizeMultiDof() {
  allocateJacobiansMultiDof();
  const int dof = 6 + m_bodyA->getLink(m_linkA).m_dofOffset;
  jacobianA(0)[dof] = 1;
  jacobianA(1)[dof] = -1;
  m_numDofsFinalized = m_jacSizeBoth;
}

int JointStop::getIslandIdA() const { return m_bodyA->getLink(m_linkA).m_collider->getIslandTag(); }

void JointStop::createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                                     const btContactSolverInfo& info) {
  if (m_numDofsFinalized != m_jacSizeBoth) finalizeMultiDof();
  const double position = m_bodyA->getJointPos(m_linkA);
  const std::array<double, 2> gaps = {position - lower_, upper_ - position};
  for (int side = 0; side < 2; ++side) {
    const double gap = gaps[static_cast<std::size_t>(side)];
    const double towards = (side == 0 ? -1 : 1) * m_bodyA->getJointVel(m_linkA);
    // Only where the step could reach the stop.
    if (gap > std::max(0.0, towards * info.m_timeStep)) continue;
    btMultiBodySolverConstraint& row = rows.expandNonInitializing();
    row.m_orgConstraint = this;
    row.m_orgDofIndex = side;
    row.m_multiBodyA = m_bodyA;
    row.m_multiBodyB = m_bodyB;
    const btVector3 none(0, 0, 0);
    const double speed = fillMultiBodyConstraint(row, data, jacobianA(side), jacobianB(side), none, none,
                                                 none, none, 0, info, 0, kUnlimited);
    // Opening speed after the step: as much as closes the gap, or as takes back part of what is beyond.
    const double wanted = gap > 0 ? -gap / info.m_timeStep : -gap * info.m_erp2 / info.m_timeStep;
    row.m_rhs = (wanted - speed) * row.m_jacDiagABInv;
    row.m_rhsPenetration = 0;
    row.m_lowerLimit = 0;
    row.m_upperLimit = kUnlimited;
    for (btVector3* moment : {&row.m_contactNormal1, &row.m_contactNormal2, &row.m_relpos1CrossNormal,
                              &row.m_relpos2CrossNormal}) {
      *moment = none;
    }
  }
}

}  // namespace walkman::plant
