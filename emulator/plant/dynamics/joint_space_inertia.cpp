#include "emulator/plant/dynamics/joint_space_inertia.h"

#include <cmath>

namespace walkman::plant {
namespace {

constexpr double kMassless = 1e-15;  // kg or kg m^2
constexpr double kHeld = 1e150;

}  // namespace

void JointSpaceInertia::Composite::add(const Composite& other) {
  mass += other.mass;
  first_moment += other.first_moment;
  xx += other.xx;
  yy += other.yy;
  zz += other.zz;
  xy += other.xy;
  xz += other.xz;
  yz += other.yz;
}

JointSpaceInertia::Spatial JointSpaceInertia::Composite::times(const Spatial& motion) const {
  const btVector3& w = motion.angular;
  const btVector3 turned(xx * w[0] + xy * w[1] + xz * w[2], xy * w[0] + yy * w[1] + yz * w[2],
                         xz * w[0] + yz * w[1] + zz * w[2]);
  return {turned + first_moment.cross(motion.linear), motion.linear * mass + w.cross(first_moment)};
}

void JointSpaceInertia::update(const btMultiBody& body) {
  origin_ = body.getBasePos();
  const auto links = static_cast<std::size_t>(body.getNumLinks());
  if (last_velocity_.size() != links + 1 || fixed_ != body.hasFixedBase()) {
    fixed_ = body.hasFixedBase();
    lay_out(body);
  }
  find_axes(body);
  factor_.assign(paths_.size(), 0);
  fill_rows(body);
  factorise();
}

std::span<const int> JointSpaceInertia::path_of(int velocity) const {
  if (velocity < 0) return {};
  const auto v = static_cast<std::size_t>(velocity);
  return {&paths_[start_[v]], static_cast<std::size_t>(length_[v])};
}

std::span<const int> JointSpaceInertia::path(int link) const {
  return path_of(last_velocity_[static_cast<std::size_t>(link) + 1]);
}

void JointSpaceInertia::append_path(int parent, int velocity) {
  const std::size_t start = paths_.size();
  const std::span<const int> before = path_of(parent);
  const auto length = before.size();
  const std::size_t from = length > 0 ? start_[static_cast<std::size_t>(parent)] : 0;
  for (std::size_t i = 0; i < length; ++i) paths_.push_back(paths_[from + i]);
  paths_.push_back(velocity);
  start_.push_back(start);
  length_.push_back(static_cast<int>(length) + 1);
}

void JointSpaceInertia::lay_out(const btMultiBody& body) {
  paths_.clear();
  start_.clear();
  length_.clear();
  last_velocity_.assign(1, fixed_ ? -1 : kBaseVelocities - 1);
  for (int v = 0; v < kBaseVelocities; ++v) append_path(fixed_ ? -1 : v - 1, v);
  for (int i = 0; i < body.getNumLinks(); ++i) {
    const btMultibodyLink& link = body.getLink(i);
    int last = last_velocity_[static_cast<std::size_t>(link.m_parent) + 1];
    for (int d = 0; d < link.m_dofCount; ++d) {
      append_path(last, kBaseVelocities + link.m_dofOffset + d);
      last = kBaseVelocities + link.m_dofOffset + d;
    }
    last_velocity_.push_back(last);
  }
}

void JointSpaceInertia::find_axes(const btMultiBody& body) {
  axes_.assign(kBaseVelocities, Spatial{});
  for (int i = 0; i < body.getNumLinks(); ++i) {
    const btMultibodyLink& link = body.getLink(i);
    const btMatrix3x3& R = link.m_cachedWorldTransform.getBasis();
    for (int d = 0; d < link.m_dofCount; ++d) {
      const btVector3 w = R * link.m_axes[d].m_topVec;
      const btVector3 v = R * link.m_axes[d].m_bottomVec;
      axes_.push_back({w, v + w.cross(origin_ - link.m_cachedWorldTransform.getOrigin())});
    }
  }
}

JointSpaceInertia::Composite JointSpaceInertia::composite(const btTransform& X_WM, double mass,
                                                          const btVector3& inertia) const {
  const btVector3 c = X_WM.getOrigin() - origin_;
  const btMatrix3x3& R = X_WM.getBasis();
  const auto moment = [&](int a, int b) {
    return R[a][0] * inertia[0] * R[b][0] + R[a][1] * inertia[1] * R[b][1] + R[a][2] * inertia[2] * R[b][2] -
           mass * c[a] * c[b];
  };
  const double square = mass * c.length2();
  return {mass,         c * mass,     moment(0, 0) + square, moment(1, 1) + square, moment(2, 2) + square,
          moment(0, 1), moment(0, 2), moment(1, 2)};
}

void JointSpaceInertia::fill_rows(const btMultiBody& body) {
  bodies_.clear();
  bodies_.push_back(composite(body.getBaseWorldTransform(), body.getBaseMass(), body.getBaseInertia()));
  for (int i = 0; i < body.getNumLinks(); ++i) {
    const btMultibodyLink& link = body.getLink(i);
    bodies_.push_back(composite(link.m_cachedWorldTransform, link.m_mass, link.m_inertiaLocal));
  }
  composites_ = bodies_;
  for (int i = body.getNumLinks() - 1; i >= 0; --i) {
    const btMultibodyLink& link = body.getLink(i);
    const Composite& carried = composites_[static_cast<std::size_t>(i) + 1];
    for (int d = 0; d < link.m_dofCount; ++d) {
      const int velocity = kBaseVelocities + link.m_dofOffset + d;
      const Spatial& S = axes_[static_cast<std::size_t>(velocity)];
      const auto [moment, force] = carried.times(S);
      const std::span<const int> path = path_of(velocity);
      double* entry = row(velocity);
      std::size_t k = 0;
      if (!fixed_) {
        for (; k < kBaseVelocities; ++k)
          entry[k] = k < 3 ? moment[static_cast<int>(k)] : force[static_cast<int>(k) - 3];
      }
      for (; k < path.size(); ++k) {
        const Spatial& other = axes_[static_cast<std::size_t>(path[k])];
        entry[k] = other.angular.dot(moment) + other.linear.dot(force);
      }
    }
    composites_[static_cast<std::size_t>(link.m_parent) + 1].add(carried);
  }
  if (fixed_) {
    for (int v = 0; v < kBaseVelocities; ++v) row(v)[0] = 1;  // on no path
    return;
  }
  const Composite& all = composites_.front();
  const btVector3& h = all.first_moment;
  const double block[kBaseVelocities][kBaseVelocities] = {
      {all.xx},
      {all.xy, all.yy},
      {all.xz, all.yz, all.zz},
      {0, h[2], -h[1], all.mass},
      {-h[2], 0, h[0], 0, all.mass},
      {h[1], -h[0], 0, 0, 0, all.mass},
  };
  for (int v = 0; v < kBaseVelocities; ++v) {
    for (int k = 0; k <= v; ++k) row(v)[k] = block[v][k];
  }
}

void JointSpaceInertia::factorise() {
  for (int v = static_cast<int>(start_.size()) - 1; v >= 0; --v) {
    const std::span<const int> path = path_of(v);
    double* own = row(v);
    const int last = static_cast<int>(path.size()) - 1;
    // A joint that carries no mass is held in place: an impulse on it would move it without limit.
    const double diagonal = own[last] > kMassless ? std::sqrt(own[last]) : kHeld;
    for (int k = 0; k < last; ++k) own[k] /= diagonal;
    own[last] = diagonal;
    for (int a = 0; a < last; ++a) {
      double* ancestor = row(path[static_cast<std::size_t>(a)]);
      const double factor = own[a];
      for (int k = 0; k <= a; ++k) ancestor[k] -= factor * own[k];
    }
  }
}

void JointSpaceInertia::point_jacobian(int link, const btVector3& p_WP, const btVector3& direction,
                                       double* row) const {
  const btVector3 moment = (p_WP - origin_).cross(direction);
  const std::span<const int> along = path(link);
  std::size_t k = 0;
  if (!fixed_) {
    for (; k < kBaseVelocities; ++k)
      row[k] = k < 3 ? moment[static_cast<int>(k)] : direction[static_cast<int>(k) - 3];
  }
  for (; k < along.size(); ++k) {
    const Spatial& axis = axes_[static_cast<std::size_t>(along[k])];
    row[k] = axis.angular.dot(moment) + axis.linear.dot(direction);
  }
}

void JointSpaceInertia::turn_jacobian(int link, const btVector3& axis, double* row) const {
  const std::span<const int> along = path(link);
  std::size_t k = 0;
  if (!fixed_) {
    for (; k < kBaseVelocities; ++k) row[k] = k < 3 ? axis[static_cast<int>(k)] : 0;
  }
  for (; k < along.size(); ++k) row[k] = axes_[static_cast<std::size_t>(along[k])].angular.dot(axis);
}

WALKMAN_WIDE_VECTORS void JointSpaceInertia::whiten(int link, double* j) const {
  const std::span<const int> along = path(link);
  for (std::size_t a = along.size(); a-- > 0;) {
    const double* own = row(along[a]);
    const double value = j[a] /= own[a];
    for (std::size_t k = 0; k < a; ++k) j[k] -= value * own[k];
  }
}

void JointSpaceInertia::solve(std::span<double> forces) const {
  const std::size_t first = fixed_ ? kBaseVelocities : 0;
  for (std::size_t v = forces.size(); v-- > first;) {
    const std::span<const int> along = path_of(static_cast<int>(v));
    const double* own = row(static_cast<int>(v));
    const double value = forces[v] /= own[along.size() - 1];
    for (std::size_t k = 0; k + 1 < along.size(); ++k)
      forces[static_cast<std::size_t>(along[k])] -= value * own[k];
  }
  unwhiten(forces);
}

void JointSpaceInertia::unwhiten(std::span<double> z) const {
  for (std::size_t v = fixed_ ? kBaseVelocities : 0; v < z.size(); ++v) {
    const std::span<const int> along = path_of(static_cast<int>(v));
    const double* own = row(static_cast<int>(v));
    double sum = z[v];
    for (std::size_t k = 0; k + 1 < along.size(); ++k) sum -= own[k] * z[static_cast<std::size_t>(along[k])];
    z[v] = sum / own[along.size() - 1];
  }
}

}  // namespace walkman::plant
