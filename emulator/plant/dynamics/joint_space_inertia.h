#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <BulletDynamics/Featherstone/btMultiBody.h>

// Compiles a function for wider vectors too and selects the version at program start: the same products and
// sums in the same order, so the same bits. Sanitizers are not yet running when the selection is made.
#if defined(__x86_64__) && defined(__GLIBC__) && !defined(__SANITIZE_THREAD__) && \
    !defined(__SANITIZE_ADDRESS__)
#define WALKMAN_WIDE_VECTORS __attribute__((target_clones("avx2", "default")))
#else
#define WALKMAN_WIDE_VECTORS
#endif

namespace walkman::plant {

/// Joint-space inertia H of a multibody at its cached poses, factorised along its branches: H = Lᵀ L.
///
/// Composite rigid bodies and branch-induced sparsity as in Featherstone, Rigid Body Dynamics Algorithms
/// (2008), §6.2, §6.4 and §6.5: a row of L has entries only where the joint's ancestors are, so a row of a
/// contact's Jacobian never leaves the path from the base to its link.
///
/// Velocities are numbered as in btMultiBody::getVelocityVector(): angular and linear velocity of the base's
/// centre of mass in world axes, then the joints. Paths of a fixed base omit its six.
class JointSpaceInertia {
 public:
  static constexpr int kBaseVelocities = 6;

  /// Angular and linear part of a spatial vector about `origin`, in world axes (Featherstone 2008, §2).
  struct Spatial {
    btVector3 angular{0, 0, 0}, linear{0, 0, 0};
  };
  /// Inertia of a body, or of a body and all it carries, about `origin`, in world axes.
  struct Composite {
    double mass = 0;
    btVector3 first_moment{0, 0, 0};                        // mass times position
    double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;  // moment of inertia
    void add(const Composite& other);
    /// Returns the momentum for a motion, or the force for an acceleration.
    [[nodiscard]] Spatial times(const Spatial& motion) const;
  };

  /// `body` must be the same in every call, with an unchanged tree.
  void update(const btMultiBody& body);

  /// The base's centre of mass at `update`, in W, m: the reference point of all quantities here.
  [[nodiscard]] const btVector3& origin() const { return origin_; }
  /// Inertia of each body alone, the base first.
  [[nodiscard]] const std::vector<Composite>& bodies() const { return bodies_; }
  /// How each joint's velocity moves the bodies it carries; the entries of the base's six are not used.
  [[nodiscard]] const std::vector<Spatial>& axes() const { return axes_; }
  /// Replaces generalised forces by the accelerations H⁻¹ τ, in place; `forces` is as long as the velocity
  /// vector.
  void solve(std::span<double> forces) const;

  /// Indices of the velocities that move `link` (−1: the base), from the base outwards.
  [[nodiscard]] std::span<const int> path(int link) const;

  /// Jacobian of a point's velocity along `direction`, both in W; `row` has one entry per velocity on the
  /// link's path.
  void point_jacobian(int link, const btVector3& p_WP, const btVector3& direction, double* row) const;

  /// The same for the link's angular velocity about `axis`, in W.
  void turn_jacobian(int link, const btVector3& axis, double* row) const;

  /// Replaces `row` by L⁻ᵀ row, in place, on the link's path. The dot product of two such rows over the
  /// common part of their paths is their entry of J H⁻¹ Jᵀ.
  void whiten(int link, double* row) const;

  /// Replaces `z` by the velocity L⁻¹ z, in place; it is as long as the velocity vector.
  void unwhiten(std::span<double> z) const;

 private:
  void lay_out(const btMultiBody& body);
  void find_axes(const btMultiBody& body);
  void append_path(int parent, int velocity);
  [[nodiscard]] Composite composite(const btTransform& X_WM, double mass, const btVector3& inertia) const;
  void fill_rows(const btMultiBody& body);
  void factorise();
  [[nodiscard]] double* row(int velocity) { return &factor_[start_[static_cast<std::size_t>(velocity)]]; }
  [[nodiscard]] const double* row(int velocity) const {
    return &factor_[start_[static_cast<std::size_t>(velocity)]];
  }
  [[nodiscard]] std::span<const int> path_of(int velocity) const;

  bool fixed_ = false;
  btVector3 origin_{0, 0, 0};
  std::vector<int> last_velocity_;  // of each link, base first: the outermost on its path, or −1
  std::vector<std::size_t> start_;  // of a velocity's row in `paths_` and `factor_`
  std::vector<int> length_;         // of that row, itself included
  std::vector<int> paths_;
  std::vector<double> factor_;                  // H, then L
  std::vector<Spatial> axes_;                   // of each joint velocity, at `origin_`
  std::vector<Composite> bodies_, composites_;  // base first
};

}  // namespace walkman::plant
