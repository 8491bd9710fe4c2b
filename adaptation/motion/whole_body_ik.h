#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "adaptation/motion/kinematic_tree.h"
#include "adaptation/motion/priority_cascade.h"

namespace walkman::motion {

enum class BaseMotion {
  kFixed,     ///< the root link stays where KinematicTree::set_base puts it
  kFloating,  ///< six more variables: the root's [angular; linear] velocity in W
};

/// Rate limits of every joint's reference. Position limits come from the model.
struct JointRates {
  double velocity = 1.0;  ///< rad/s; the model's limit if that is lower
  double acceleration =
      8.0;  ///< rad/s², between consecutive steps and when slowing down before a position limit
};

/// Whole-body inverse kinematics at one instant: joint velocities from tasks in order of priority.
///
/// A cycle is `start`, then for each priority `next_level` and its tasks, `keep_clear` for obstacles at any
/// time, then `solve`. Each task requests a velocity: its feed-forward plus gain (1/s) times its error.
/// Position limits, joint velocities, accelerations and obstacles are enforced at every level. Zero motion
/// always satisfies position limits and obstacles; if they cannot be met within the acceleration bound, that
/// bound is given up.
///
/// Nothing allocates or throws after construction. Cascade as in OpenSoT, the library of the paper's sec. 4.
class WholeBodyIk {
 public:
  /// `active`: degrees of freedom of `kinematics` that may move; the rest are held. Keeps a reference to
  /// `kinematics`. Throws std::runtime_error if more than kMaxVariables variables are needed.
  WholeBodyIk(const KinematicTree& kinematics, BaseMotion base, std::vector<int> active,
              const JointRates& rates);

  /// Number of variables of the cascade: active joints, and six for a floating base.
  [[nodiscard]] int variables() const { return first_joint_ + static_cast<int>(active_.size()); }

  /// Starts a cycle at joint positions q (n), to which `kinematics` has been updated; dt in s.
  void start(const Eigen::VectorXd& q, double dt) noexcept;
  /// Opens the next priority. `damping` weights squared joint velocity against squared task errors (m/s,
  /// rad/s): it bounds velocities where the tasks could only be met by racing joints, at the cost of a little
  /// lag there.
  void next_level(double damping = 1e-6) noexcept;

  /// Drives frame P, fixed to `link` with its origin at p_LP (m) and the link's axes, to X_WP. V_WP is the
  /// target's own [angular; linear] velocity in W (rad/s, m/s). `gain` in 1/s, here and below.
  void track_pose(int link, const Eigen::Vector3d& p_LP, const Eigen::Isometry3d& X_WP,
                  const Eigen::Matrix<double, 6, 1>& V_WP, double gain) noexcept;
  /// Drives the axes of `link` to R_WL, whose own angular velocity is w_WL (rad/s, in W).
  void track_orientation(int link, const Eigen::Matrix3d& R_WL, const Eigen::Vector3d& w_WL,
                         double gain) noexcept;
  /// Drives the centre of mass to the horizontal position p_Wcm (m), which itself moves at v_Wcm (m/s), both
  /// in W.
  void track_com(const Eigen::Vector2d& p_Wcm, const Eigen::Vector2d& v_Wcm, double gain) noexcept;
  /// Drives one joint, by degree of freedom, to a position (rad or m), with a weight relative to the level's
  /// other tasks. Ignored for a joint that is not active.
  void track_joint(int dof, double position, double gain, double weight = 1) noexcept;

  /// Half-space constraint: the point p_LP of `link` may move against n_W (unit, pointing to the free side)
  /// at no more than `approach` (m/s, not negative).
  void keep_clear(int link, const Eigen::Vector3d& p_LP, const Eigen::Vector3d& n_W,
                  double approach) noexcept;
  /// The same relative to the point p_KQ of another link K of the robot.
  void keep_apart(int link, const Eigen::Vector3d& p_LP, int other, const Eigen::Vector3d& p_KQ,
                  const Eigen::Vector3d& n_W, double approach) noexcept;
  /// Restricts joint `dof` to [lower, upper] (rad or m) in addition to its own limits.
  void limit_joint(int dof, double lower, double upper) noexcept;
  /// Sets different rates for one joint, by degree of freedom. Ignored for a joint that is not active.
  void limit_rates(int dof, const JointRates& rates) noexcept;

  /// On failure all velocities are zero: the caller's reference stays where it was.
  [[nodiscard]] QpStatus solve() noexcept;
  /// Joint velocities (n, rad/s or m/s), zero for joints that are not active.
  [[nodiscard]] const Eigen::VectorXd& joint_velocity() const { return joint_velocity_; }
  /// [angular; linear] velocity of the root in W; zero for a fixed base.
  [[nodiscard]] const Eigen::Matrix<double, 6, 1>& base_velocity() const { return base_velocity_; }
  /// What kept a priority's tasks from being met in the last solution, other than joint rates.
  struct Binding {
    int dof = -1;        ///< degree of freedom of a joint close to its position limit, −1 if none
    bool upper = false;  ///< whether at its upper limit
    int contact = -1;    ///< number of keep_clear and keep_apart calls before the binding one; −1 if none
  };
  /// The constraint that did most to keep the `level`-th priority (from 0) from its tasks.
  [[nodiscard]] Binding binding(int level) const noexcept;
  /// Clears the last velocities, which the acceleration bound refers to.
  void reset_rates() noexcept;

 private:
  void fill_jacobian(int link, const Eigen::Vector3d& p_LP) noexcept;
  /// Adds to `rate_`, see KinematicTree::add_point_rate.
  void add_rate(int link, const Eigen::Vector3d& p_LP, const Eigen::Vector3d& n_W, double share) noexcept;
  void append_inequality(double approach) noexcept;
  void append(int first_row, int rows, const Eigen::Matrix<double, 6, 1>& velocity) noexcept;
  /// `acceleration`: as a multiple of the rates'.
  void write_joint_bounds(double acceleration) noexcept;

  const KinematicTree* kinematics_;
  BaseMotion base_;
  int first_joint_;
  std::vector<int> active_;
  std::vector<JointRates> rates_;  // of the active joints

  double dt_ = 0;
  Eigen::VectorXd q_;
  PriorityCascade cascade_;
  PriorityLevel* level_ = nullptr;
  Eigen::MatrixXd J_full_;                                                         ///< 6 × (6+n) or 6 × n
  Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kMaxVariables> J_;  ///< the variables' columns
  std::vector<double> lower_limit_, upper_limit_;                                  ///< of the active joints
  Eigen::VectorXd rate_;                                                           ///< 6+n or n
  InequalityMatrix C_;
  InequalityVector d_;
  Eigen::VectorXd joint_velocity_;
  Eigen::Matrix<double, 6, 1> base_velocity_ = Eigen::Matrix<double, 6, 1>::Zero();
};

/// Rotation vector in W that turns R_from into R_to, rad.
[[nodiscard]] Eigen::Vector3d rotation_error(const Eigen::Matrix3d& R_to,
                                             const Eigen::Matrix3d& R_from) noexcept;

}  // namespace walkman::motion
