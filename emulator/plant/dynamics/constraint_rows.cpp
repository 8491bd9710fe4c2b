#include "emulator/plant/dynamics/constraint_rows.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include "emulator/plant/contact/collider_parts.h"

namespace walkman::plant {
namespace {

/// Points at which a contact's force acts on A and its reaction on B. Soft surfaces overlap by millimetres;
/// for them both are the point halfway between, because friction at each surface's own point would create a
/// torque out of nothing.
struct PointsOfAction {
  btVector3 on_A, on_B;
};

PointsOfAction acts_at(const btManifoldPoint& point) {
  const btVector3 &p_WA = point.getPositionWorldOnA(), &p_WB = point.getPositionWorldOnB();
  if ((point.m_contactPointFlags & BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING) == 0) return {p_WA, p_WB};
  return {(p_WA + p_WB) / 2, (p_WA + p_WB) / 2};
}

using Rows = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>, 0,
                        Eigen::OuterStride<>>;

// Tangential over normal stiffness of an incompressible pad (Mindlin 1949: 2 (1 − ν) / (2 − ν), ν = 0.5).
constexpr double kTangentialShare = 2.0 / 3;
constexpr double kBouncing = 0.05;  // m/s; slower impacts do not bounce

btVector3 origin_of(const btMultiBody& body, int link) {
  return link < 0 ? body.getBasePos() : body.getLink(link).m_cachedWorldTransform.getOrigin();
}

/// Impulse on body A.
btVector3 impulse_of(const btManifoldPoint& point) {
  return point.m_normalWorldOnB * point.m_appliedImpulse +
         point.m_lateralFrictionDir1 * point.m_appliedImpulseLateral1 +
         point.m_lateralFrictionDir2 * point.m_appliedImpulseLateral2;
}

}  // namespace

void ConstraintRows::build(std::span<const KnownBody> bodies, std::span<const JointStop> stops,
                           std::span<btPersistentManifold* const> manifolds,
                           const btContactSolverInfo& info) {
  trees_.resize(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    Tree& tree = trees_[i];
    tree.body = bodies[i].body;
    tree.inertia = bodies[i].inertia;
    tree.touched = false;
  }
  blocks_.clear();
  rows_.clear();
  contacts_.clear();
  turns_.clear();
  whitened_.clear();
  for (const JointStop& stop : stops) add_stop(stop, info);
  stop_count_ = static_cast<int>(rows_.size());
  for (btPersistentManifold* manifold : manifolds) add_manifold(*manifold, info);
  int contact = 0;
  for (btPersistentManifold* manifold : manifolds) {
    add_turns(*manifold, contact);
    contact += manifold->getNumContacts();
  }
}

int ConstraintRows::tree_of(const btMultiBody* body) {
  const auto tree = std::find_if(trees_.begin(), trees_.end(), [&](const Tree& t) { return t.body == body; });
  if (!tree->touched) {
    tree->touched = true;
    tree->change.assign(6 + static_cast<std::size_t>(body->getNumDofs()), 0);
  }
  return static_cast<int>(tree - trees_.begin());
}

RowBlock::Side ConstraintRows::side(int tree, int link, int rows) {
  RowBlock::Side side{tree, link, whitened_.size(), 0};
  if (tree < 0) return side;
  side.length = static_cast<int>(trees_[static_cast<std::size_t>(tree)].inertia->path(link).size());
  whitened_.resize(whitened_.size() + static_cast<std::size_t>(rows * side.length));
  return side;
}

void ConstraintRows::add_stop(const JointStop& stop, const btContactSolverInfo& info) {
  const auto end = stop.reached(info.m_timeStep, info.m_erp2);
  if (!end) return;
  RowBlock block;
  block.a = side(tree_of(&stop.body()), stop.link(), 1);
  block.first_row = static_cast<int>(rows_.size());
  block.row_count = 1;
  double* entries = whitened_.data() + block.a.first_entry;
  entries[block.a.length - 1] = end->direction;
  trees_[static_cast<std::size_t>(block.a.tree)].inertia->whiten(stop.link(), entries);
  rows_.push_back({end->direction * stop.body().getJointVel(stop.link()), end->target, 0});
  blocks_.push_back(block);
}

void ConstraintRows::add_manifold(btPersistentManifold& manifold, const btContactSolverInfo& info) {
  if (manifold.getNumContacts() == 0) return;
  RowBlock block = block_between(manifold, kContactRows * manifold.getNumContacts());
  block.first_contact = static_cast<int>(contacts_.size());
  const btMatrix3x3& R_WA = manifold.getBody0()->getWorldTransform().getBasis();
  for (int i = 0; i < manifold.getNumContacts(); ++i)
    add_contact(block, R_WA, manifold.getContactPoint(i), info);
  blocks_.push_back(block);
}

RowBlock ConstraintRows::block_between(const btPersistentManifold& manifold, int rows) {
  const auto* a = btMultiBodyLinkCollider::upcast(manifold.getBody0());
  const auto* b = btMultiBodyLinkCollider::upcast(manifold.getBody1());
  RowBlock block;
  block.first_row = static_cast<int>(rows_.size());
  block.row_count = rows;
  block.a = side(a == nullptr ? -1 : tree_of(a->m_multiBody), a == nullptr ? -1 : a->m_link, rows);
  block.b = side(b == nullptr ? -1 : tree_of(b->m_multiBody), b == nullptr ? -1 : b->m_link, rows);
  return block;
}

void ConstraintRows::add_contact(const RowBlock& block, const btMatrix3x3& R_WA, btManifoldPoint& point,
                                 const btContactSolverInfo& info) {
  const double dt = info.m_timeStep;
  // A spring and damper integrated implicitly are a compliant row that corrects a share of the error per
  // step.
  const auto soft = [dt](double stiffness, double damping) {
    const double sum = dt * stiffness + damping;
    return std::pair{1 / (sum * dt), dt * stiffness / sum};
  };
  double softness = info.m_globalCfm / dt;
  double erp = info.m_erp2;
  double along = 0;
  double erp_along = info.m_frictionERP;
  double give = 0;
  if ((point.m_contactPointFlags & BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING) != 0) {
    const double stiffness = point.m_combinedContactStiffness1;
    const double damping = point.m_combinedContactDamping1;
    std::tie(softness, erp) = soft(stiffness, damping);
    std::tie(along, erp_along) = soft(kTangentialShare * stiffness, kTangentialShare * damping);
    give = 1 / (kTangentialShare * stiffness);
  }
  const double gap = point.getDistance() + info.m_linearSlop;
  contacts_.push_back({&point, &R_WA, point.m_combinedFriction, give});
  const double speed = add_direction(block, point, point.m_normalWorldOnB);
  double target = -gap * (gap > 0 ? 1 : erp) / dt;
  // Surfaces that would meet within the step bounce now: if slowed down until they touch, they would have no
  // speed left to give back.
  if (point.m_combinedRestitution > 0 && speed < -kBouncing && gap + speed * dt <= 0)
    target = std::max(target, -point.m_combinedRestitution * speed);
  const auto* stick = static_cast<const Stick*>(point.m_userPersistentData);
  const btVector3 shift = stick == nullptr ? btVector3(0, 0, 0) : R_WA * stick->shift_A;
  const btVector3 start = stick == nullptr ? btVector3(0, 0, 0) : R_WA * stick->impulse_A;
  rows_.push_back({speed, target, softness, std::max(0.0, start.dot(point.m_normalWorldOnB))});
  btPlaneSpace1(point.m_normalWorldOnB, point.m_lateralFrictionDir1, point.m_lateralFrictionDir2);
  for (const btVector3& tangent : {point.m_lateralFrictionDir1, point.m_lateralFrictionDir2}) {
    const double slide = add_direction(block, point, tangent);
    rows_.push_back({slide, -shift.dot(tangent) * erp_along / dt, along, start.dot(tangent)});
  }
}

void ConstraintRows::add_turns(btPersistentManifold& manifold, int first_contact) {
  int count = 0;
  const auto resists = [](const btManifoldPoint& point) {
    return point.m_combinedRollingFriction > 0 || point.m_combinedSpinningFriction > 0;
  };
  for (int i = 0; i < manifold.getNumContacts(); ++i) count += resists(manifold.getContactPoint(i)) ? 1 : 0;
  if (count == 0) return;
  const RowBlock block = block_between(manifold, kContactRows * count);
  for (int i = 0; i < manifold.getNumContacts(); ++i) {
    const btManifoldPoint& point = manifold.getContactPoint(i);
    if (!resists(point)) continue;
    turns_.push_back({static_cast<int>(rows_.size()), first_contact + i, point.m_combinedSpinningFriction,
                      point.m_combinedRollingFriction});
    for (const btVector3& axis :
         {point.m_normalWorldOnB, point.m_lateralFrictionDir1, point.m_lateralFrictionDir2}) {
      const int row = static_cast<int>(rows_.size()) - block.first_row;
      const double rate = whiten_turn(block.a, row, axis) + whiten_turn(block.b, row, -axis);
      rows_.push_back({rate, 0, 0});
    }
  }
  blocks_.push_back(block);
}

/// Adds the next row's Jacobian and returns the velocity along it.
double ConstraintRows::add_direction(const RowBlock& block, const btManifoldPoint& point,
                                     const btVector3& direction) {
  const int row = static_cast<int>(rows_.size()) - block.first_row;
  const PointsOfAction p_W = acts_at(point);
  return whiten(block.a, row, p_W.on_A, direction) + whiten(block.b, row, p_W.on_B, -direction);
}

double ConstraintRows::whiten(const RowBlock::Side& side, int row, const btVector3& p_W,
                              const btVector3& direction) {
  if (side.length == 0) return 0;
  double* entries = entries_of(side, row);
  trees_[static_cast<std::size_t>(side.tree)].inertia->point_jacobian(side.link, p_W, direction, entries);
  return whiten(side, entries);
}

double ConstraintRows::whiten_turn(const RowBlock::Side& side, int row, const btVector3& axis) {
  if (side.length == 0) return 0;
  double* entries = entries_of(side, row);
  trees_[static_cast<std::size_t>(side.tree)].inertia->turn_jacobian(side.link, axis, entries);
  return whiten(side, entries);
}

double* ConstraintRows::entries_of(const RowBlock::Side& side, int row) {
  return whitened_.data() + side.first_entry +
         static_cast<std::size_t>(row) * static_cast<std::size_t>(side.length);
}

/// Whitens a row of the Jacobian in place; returns the velocity along it.
double ConstraintRows::whiten(const RowBlock::Side& side, double* entries) const {
  const Tree& tree = trees_[static_cast<std::size_t>(side.tree)];
  const btScalar* velocity = tree.body->getVelocityVector();
  double along = 0;
  const double* entry = entries;
  for (const int v : tree.inertia->path(side.link)) along += *entry++ * velocity[v];
  tree.inertia->whiten(side.link, entries);
  return along;
}

bool ConstraintRows::couple(const RowBlock& rows, const RowBlock::Side& s, const RowBlock& columns,
                            const RowBlock::Side& t, bool first, Eigen::MatrixXd& W) const {
  if (s.tree < 0 || s.tree != t.tree) return false;
  const JointSpaceInertia& inertia = *trees_[static_cast<std::size_t>(s.tree)].inertia;
  const std::span<const int> path_s = inertia.path(s.link);
  const std::span<const int> path_t = inertia.path(t.link);
  // Two paths from the base are the same up to where they branch.
  const auto common = std::mismatch(path_s.begin(), path_s.end(), path_t.begin(), path_t.end()).first;
  const auto shared = common - path_s.begin();
  if (shared == 0) return false;
  const Rows left(whitened_.data() + s.first_entry, rows.row_count, s.length, Eigen::OuterStride<>(s.length));
  const Rows right(whitened_.data() + t.first_entry, columns.row_count, t.length,
                   Eigen::OuterStride<>(t.length));
  auto block = W.block(rows.first_row, columns.first_row, rows.row_count, columns.row_count);
  const auto coupled = left.leftCols(shared) * right.leftCols(shared).transpose();
  if (first) {
    block.noalias() = coupled;
  } else {
    block.noalias() += coupled;
  }
  return true;
}

void ConstraintRows::delassus(Eigen::MatrixXd& W) const {
  const auto count = static_cast<Eigen::Index>(rows_.size());
  W.resize(count, count);
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    for (std::size_t k = 0; k <= i; ++k) {
      const RowBlock& rows = blocks_[i];
      const RowBlock& columns = blocks_[k];
      bool coupled = false;
      for (const RowBlock::Side* s : {&rows.a, &rows.b}) {
        for (const RowBlock::Side* t : {&columns.a, &columns.b})
          coupled |= couple(rows, *s, columns, *t, !coupled, W);
      }
      if (!coupled) W.block(rows.first_row, columns.first_row, rows.row_count, columns.row_count).setZero();
    }
  }
  W.triangularView<Eigen::StrictlyUpper>() = W.transpose();
}

void ConstraintRows::push_links(const RowBlock& block, const btManifoldPoint& point,
                                const btVector3& force) const {
  const auto push = [&](const RowBlock::Side& side, const btVector3& p_W, const btVector3& F) {
    if (side.tree < 0) return;
    btMultiBody& body = *trees_[static_cast<std::size_t>(side.tree)].body;
    const btVector3 torque = (p_W - origin_of(body, side.link)).cross(F);
    if (side.link < 0) {
      body.addBaseConstraintForce(F);
      body.addBaseConstraintTorque(torque);
    } else {
      body.addLinkConstraintForce(side.link, F);
      body.addLinkConstraintTorque(side.link, torque);
    }
  };
  const PointsOfAction p_W = acts_at(point);
  push(block.a, p_W.on_A, force);
  push(block.b, p_W.on_B, -force);
}

void ConstraintRows::shift(const ContactRow& contact, int row, const Eigen::VectorXd& impulses,
                           const Eigen::VectorXd& velocities, double dt) const {
  btManifoldPoint& point = *contact.point;
  auto* stick = static_cast<Stick*>(point.m_userPersistentData);
  if (stick == nullptr) return;
  stick->impulse_A.setZero();
  const double limit = contact.friction * impulses[row];
  const double held_square = impulses[row + 1] * impulses[row + 1] + impulses[row + 2] * impulses[row + 2];
  const bool slips = held_square >= limit * limit * (1 - 2e-9);
  if (limit <= 0 || (slips && contact.give == 0)) {
    stick->shift_A.setZero();
    return;
  }
  if (!slips && contact.give > 0) stick->impulse_A = impulse_of(point) * *contact.R_WA;
  btVector3 shift = *contact.R_WA * stick->shift_A;
  const btVector3& normal = point.m_normalWorldOnB;
  shift -= normal * shift.dot(normal);
  shift += (point.m_lateralFrictionDir1 * velocities[row + 1] +
            point.m_lateralFrictionDir2 * velocities[row + 2]) *
           dt;
  if (slips) {
    // A slipping contact keeps as much spring deflection as friction can hold.
    const double most = limit / dt * contact.give;
    const double length = shift.length();
    if (length > most) shift *= most / length;
  }
  stick->shift_A = shift * *contact.R_WA;
}

void ConstraintRows::apply(const Eigen::VectorXd& impulses, const Eigen::VectorXd& velocities, double dt) {
  for (const RowBlock& block : blocks_) {
    for (const RowBlock::Side* side : {&block.a, &block.b}) {
      if (side->tree < 0) continue;
      Tree& tree = trees_[static_cast<std::size_t>(side->tree)];
      const std::span<const int> path = tree.inertia->path(side->link);
      const double* entries = whitened_.data() + side->first_entry;
      for (int row = block.first_row; row < block.first_row + block.row_count; ++row) {
        for (const int v : path) tree.change[static_cast<std::size_t>(v)] += impulses[row] * *entries++;
      }
    }
    if (block.first_contact < 0) continue;
    const int contacts = block.row_count / kContactRows;
    for (int i = 0; i < contacts; ++i) {
      const ContactRow& contact =
          contacts_[static_cast<std::size_t>(block.first_contact) + static_cast<std::size_t>(i)];
      const int row = block.first_row + kContactRows * i;
      btManifoldPoint& point = *contact.point;
      point.m_appliedImpulse = impulses[row];
      point.m_appliedImpulseLateral1 = impulses[row + 1];
      point.m_appliedImpulseLateral2 = impulses[row + 2];
      shift(contact, row, impulses, velocities, dt);
      if (impulses[row] == 0) continue;
      push_links(block, point, impulse_of(point) / dt);
    }
  }
  for (const TurnRow& turn : turns_) {
    const btManifoldPoint& point = *contacts_[static_cast<std::size_t>(turn.contact)].point;
    const btVector3 moment = point.m_normalWorldOnB * impulses[turn.row] +
                             point.m_lateralFrictionDir1 * impulses[turn.row + 1] +
                             point.m_lateralFrictionDir2 * impulses[turn.row + 2];
    twist_links(turn, moment / dt);
  }
  for (Tree& tree : trees_) {
    if (!tree.touched) continue;
    tree.inertia->unwhiten(tree.change);
    tree.body->applyDeltaVeeMultiDof(tree.change.data(), 1);
  }
}

void ConstraintRows::twist_links(const TurnRow& turn, const btVector3& torque) const {
  const auto block = std::find_if(blocks_.begin(), blocks_.end(), [&](const RowBlock& candidate) {
    return turn.row >= candidate.first_row && turn.row < candidate.first_row + candidate.row_count;
  });
  const auto twist = [&](const RowBlock::Side& side, const btVector3& T) {
    if (side.tree < 0) return;
    btMultiBody& body = *trees_[static_cast<std::size_t>(side.tree)].body;
    if (side.link < 0) {
      body.addBaseConstraintTorque(T);
    } else {
      body.addLinkConstraintTorque(side.link, T);
    }
  };
  twist(block->a, torque);
  twist(block->b, -torque);
}

}  // namespace walkman::plant
