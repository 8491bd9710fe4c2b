#include "emulator/plant/dynamics/constraint_rows.h"

#include <algorithm>

#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

namespace walkman::plant {
namespace {

using Rows = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>, 0,
                        Eigen::OuterStride<>>;

btVector3 origin_of(const btMultiBody& body, int link) {
  return link < 0 ? body.getBasePos() : body.getLink(link).m_cachedWorldTransform.getOrigin();
}

/// On body A.
btVector3 impulse_of(const btManifoldPoint& point) {
  return point.m_normalWorldOnB * point.m_appliedImpulse +
         point.m_lateralFrictionDir1 * point.m_appliedImpulseLateral1 +
         point.m_lateralFrictionDir2 * point.m_appliedImpulseLateral2;
}

}  // namespace

void ConstraintRows::build(std::span<const JointStop> stops, std::span<btPersistentManifold* const> manifolds,
                           const btContactSolverInfo& info) {
  for (Tree& tree : trees_) tree.current = false;
  blocks_.clear();
  rows_.clear();
  contacts_.clear();
  whitened_.clear();
  for (const JointStop& stop : stops) add_stop(stop, info);
  stop_count_ = static_cast<int>(rows_.size());
  for (btPersistentManifold* manifold : manifolds) add_manifold(*manifold, info);
}

int ConstraintRows::tree_of(btMultiBody* body) {
  auto tree = std::find_if(trees_.begin(), trees_.end(), [&](const Tree& t) { return t.body == body; });
  // Bodies come and go; what is left of a gone one serves the next.
  if (tree == trees_.end())
    tree = std::find_if(trees_.begin(), trees_.end(), [](const Tree& t) { return !t.current; });
  if (tree == trees_.end()) tree = trees_.insert(trees_.end(), Tree{});
  if (!tree->current) {
    tree->body = body;
    tree->current = true;
    tree->inertia.update(*body);
    tree->change.assign(6 + static_cast<std::size_t>(body->getNumDofs()), 0);
  }
  return static_cast<int>(tree - trees_.begin());
}

RowBlock::Side ConstraintRows::side(int tree, int link, int rows) {
  RowBlock::Side side{tree, link, whitened_.size(), 0};
  if (tree < 0) return side;
  side.length = static_cast<int>(trees_[static_cast<std::size_t>(tree)].inertia.path(link).size());
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
  trees_[static_cast<std::size_t>(block.a.tree)].inertia.whiten(stop.link(), entries);
  rows_.push_back({end->direction * stop.body().getJointVel(stop.link()), end->target, 0});
  blocks_.push_back(block);
}

void ConstraintRows::add_manifold(btPersistentManifold& manifold, const btContactSolverInfo& info) {
  if (manifold.getNumContacts() == 0) return;
  const auto* a = btMultiBodyLinkCollider::upcast(manifold.getBody0());
  const auto* b = btMultiBodyLinkCollider::upcast(manifold.getBody1());
  RowBlock block;
  block.first_row = static_cast<int>(rows_.size());
  block.row_count = kContactRows * manifold.getNumContacts();
  block.a = side(a == nullptr ? -1 : tree_of(a->m_multiBody), a == nullptr ? -1 : a->m_link, block.row_count);
  block.b = side(b == nullptr ? -1 : tree_of(b->m_multiBody), b == nullptr ? -1 : b->m_link, block.row_count);
  for (int i = 0; i < manifold.getNumContacts(); ++i) add_contact(block, manifold.getContactPoint(i), info);
  blocks_.push_back(block);
}

void ConstraintRows::add_contact(const RowBlock& block, btManifoldPoint& point,
                                 const btContactSolverInfo& info) {
  const double dt = info.m_timeStep;
  double softness = info.m_globalCfm / dt;
  double erp = info.m_erp2;
  if ((point.m_contactPointFlags & BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING) != 0) {
    const double stiffness = dt * point.m_combinedContactStiffness1;
    const double sum = stiffness + point.m_combinedContactDamping1;
    softness = 1 / (sum * dt);
    erp = stiffness / sum;
  }
  const double gap = point.getDistance() + info.m_linearSlop;
  contacts_.push_back({&point, point.m_combinedFriction});
  const double speed = add_direction(block, point, point.m_normalWorldOnB);
  rows_.push_back({speed, -gap * (gap > 0 ? 1 : erp) / dt, softness});

  const bool anchored = (point.m_contactPointFlags & BT_CONTACT_FLAG_FRICTION_ANCHOR) != 0;
  btPlaneSpace1(point.m_normalWorldOnB, point.m_lateralFrictionDir1, point.m_lateralFrictionDir2);
  for (const btVector3& tangent : {point.m_lateralFrictionDir1, point.m_lateralFrictionDir2}) {
    const double offset = (point.getPositionWorldOnA() - point.getPositionWorldOnB()).dot(tangent);
    const double slide = add_direction(block, point, tangent);
    rows_.push_back({slide, anchored ? -offset * info.m_frictionERP / dt : 0, 0});
  }
}

/// Adds the next row's Jacobian and returns the velocity along it.
double ConstraintRows::add_direction(const RowBlock& block, const btManifoldPoint& point,
                                     const btVector3& direction) {
  const int row = static_cast<int>(rows_.size()) - block.first_row;
  return whiten(block.a, row, point.getPositionWorldOnA(), direction) +
         whiten(block.b, row, point.getPositionWorldOnB(), -direction);
}

double ConstraintRows::whiten(const RowBlock::Side& side, int row, const btVector3& p_W,
                              const btVector3& direction) {
  if (side.length == 0) return 0;
  const Tree& tree = trees_[static_cast<std::size_t>(side.tree)];
  double* entries = whitened_.data() + side.first_entry +
                    static_cast<std::size_t>(row) * static_cast<std::size_t>(side.length);
  tree.inertia.point_jacobian(side.link, p_W, direction, entries);
  const btScalar* velocity = tree.body->getVelocityVector();
  double along = 0;
  for (const int v : tree.inertia.path(side.link)) along += *entries++ * velocity[v];
  tree.inertia.whiten(side.link, entries - side.length);
  return along;
}

void ConstraintRows::couple(const RowBlock& rows, const RowBlock::Side& s, const RowBlock& columns,
                            const RowBlock::Side& t, Eigen::MatrixXd& W) const {
  if (s.tree < 0 || s.tree != t.tree) return;
  const JointSpaceInertia& inertia = trees_[static_cast<std::size_t>(s.tree)].inertia;
  const std::span<const int> path_s = inertia.path(s.link);
  const std::span<const int> path_t = inertia.path(t.link);
  // Two paths from the base agree up to where they part.
  const auto common = std::mismatch(path_s.begin(), path_s.end(), path_t.begin(), path_t.end()).first;
  const auto shared = common - path_s.begin();
  if (shared == 0) return;
  const Rows left(whitened_.data() + s.first_entry, rows.row_count, s.length, Eigen::OuterStride<>(s.length));
  const Rows right(whitened_.data() + t.first_entry, columns.row_count, t.length,
                   Eigen::OuterStride<>(t.length));
  W.block(rows.first_row, columns.first_row, rows.row_count, columns.row_count).noalias() +=
      left.leftCols(shared) * right.leftCols(shared).transpose();
}

void ConstraintRows::delassus(Eigen::MatrixXd& W) const {
  const auto count = static_cast<Eigen::Index>(rows_.size());
  W.setZero(count, count);
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    for (std::size_t k = 0; k <= i; ++k) {
      for (const RowBlock::Side* s : {&blocks_[i].a, &blocks_[i].b}) {
        for (const RowBlock::Side* t : {&blocks_[k].a, &blocks_[k].b})
          couple(blocks_[i], *s, blocks_[k], *t, W);
      }
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
  push(block.a, point.getPositionWorldOnA(), force);
  push(block.b, point.getPositionWorldOnB(), -force);
}

void ConstraintRows::apply(const Eigen::VectorXd& impulses, double dt) {
  for (const RowBlock& block : blocks_) {
    for (const RowBlock::Side* side : {&block.a, &block.b}) {
      if (side->tree < 0) continue;
      Tree& tree = trees_[static_cast<std::size_t>(side->tree)];
      const std::span<const int> path = tree.inertia.path(side->link);
      const double* entries = whitened_.data() + side->first_entry;
      for (int row = block.first_row; row < block.first_row + block.row_count; ++row) {
        for (const int v : path) tree.change[static_cast<std::size_t>(v)] += impulses[row] * *entries++;
      }
    }
    for (int row = block.first_row; row + kContactRows <= block.first_row + block.row_count;
         row += kContactRows) {
      btManifoldPoint& point = *contacts_[static_cast<std::size_t>((row - stop_count_) / kContactRows)].point;
      point.m_appliedImpulse = impulses[row];
      point.m_appliedImpulseLateral1 = impulses[row + 1];
      point.m_appliedImpulseLateral2 = impulses[row + 2];
      if (impulses[row] == 0) continue;
      push_links(block, point, impulse_of(point) / dt);
    }
  }
  for (Tree& tree : trees_) {
    if (!tree.current) continue;
    tree.inertia.unwhiten(tree.change);
    tree.body->applyDeltaVeeMultiDof2(tree.change.data(), 1);
  }
}

}  // namespace walkman::plant
