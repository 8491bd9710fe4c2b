#pragma once

#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "urdf/reader/robot_model.h"

namespace walkman::motion {

/// Gravity as the force per mass on the ground of W, m/s², along −z of W.
inline constexpr double kGravity = 9.81;

/// Kinematics, centre of mass and static torques of a robot whose links form a tree.
///
/// The joints named at construction are the degrees of freedom, in that order (n of them). All others are
/// passive: they keep the value given by `set_passive` (initially zero). A mimic joint follows its master,
/// whether that is passive or a degree of freedom. After construction only `set_passive` allocates or throws.
class KinematicTree {
 public:
  /// Keeps a reference to `model`, which must outlive this. Throws std::runtime_error for a name that is not
  /// a moving joint of the model, is a mimic joint, or appears twice.
  KinematicTree(const RobotModel& model, const std::vector<std::string>& joint_names);

  [[nodiscard]] const RobotModel& model() const { return *model_; }
  [[nodiscard]] int dof() const { return static_cast<int>(joint_of_dof_.size()); }
  /// Limits of degree of freedom `i`, as in the model (rad or m, and their rates; N·m or N).
  [[nodiscard]] const JointLimits& limits(int i) const;
  /// Degree of freedom of the named joint, −1 for a passive one. Throws std::out_of_range if unknown.
  [[nodiscard]] int dof_of(const std::string& joint_name) const;

  /// Pose of the root link B.
  void set_base(const Eigen::Isometry3d& X_WB) noexcept { X_WB_ = X_WB; }
  [[nodiscard]] const Eigen::Isometry3d& X_WB() const noexcept { return X_WB_; }
  /// Sets the value (rad or m) of a passive joint. Throws std::runtime_error for a degree of freedom or a
  /// mimic joint.
  void set_passive(const std::string& joint_name, double value);
  /// Sets a point mass (kg) fixed to `link` at `p_LP` (m, link frame), included in CoM and gravity torques.
  /// Zero removes it.
  void set_payload(double mass, int link, const Eigen::Vector3d& p_LP) noexcept;

  /// Poses all links at q (n, rad or m). Everything below refers to the last update.
  void update(const Eigen::Ref<const Eigen::VectorXd>& q) noexcept;

  /// Pose of a link, by its index in the model.
  [[nodiscard]] const Eigen::Isometry3d& X_WL(int link) const noexcept {
    return X_WL_[static_cast<std::size_t>(link)];
  }

  /// Jacobian of the point p_LP (m) of a link: [angular; linear] velocity in W per joint velocity, 6×n.
  void jacobian(int link, const Eigen::Vector3d& p_LP, Eigen::Ref<Eigen::MatrixXd> J) const noexcept;
  /// The same with six leading columns for the base's [angular; linear] velocity in W about its origin,
  /// 6×(6+n).
  void floating_jacobian(int link, const Eigen::Vector3d& p_LP, Eigen::Ref<Eigen::MatrixXd> J) const noexcept;
  /// Adds to `rate` (n) `share` times the velocity along n_W, per joint velocity, of the point p_WP (m) as
  /// fixed to a link.
  void add_point_rate(int link, const Eigen::Vector3d& p_WP, const Eigen::Vector3d& n_W, double share,
                      Eigen::Ref<Eigen::VectorXd> rate) const noexcept;
  /// The same with the base's six entries first: 6+n.
  void add_floating_point_rate(int link, const Eigen::Vector3d& p_WP, const Eigen::Vector3d& n_W,
                               double share, Eigen::Ref<Eigen::VectorXd> rate) const noexcept;

  /// Mass of robot and payload, kg.
  [[nodiscard]] double total_mass() const noexcept { return mass_ + payload_mass_; }
  /// Centre of mass of robot and payload in W, m.
  [[nodiscard]] const Eigen::Vector3d& com() const noexcept { return p_Wcm_; }
  /// Linear velocity of the CoM in W per joint velocity, 3×n.
  void com_jacobian(Eigen::Ref<Eigen::MatrixXd> J) const noexcept;
  /// The same with six leading columns for the base, 3×(6+n).
  void floating_com_jacobian(Eigen::Ref<Eigen::MatrixXd> J) const noexcept;

  /// Joint torques (n, N·m or N) that hold robot and payload still against gravity with the base held.
  void gravity_torques(Eigen::Ref<Eigen::VectorXd> tau) const noexcept;

 private:
  struct JointState {
    int dof = -1;         ///< degree of freedom that moves it, −1 if passive
    int master = -1;      ///< joint it mimics, −1 if none
    double scale = 1;     ///< of a mimic joint
    double offset = 0;    ///< of a mimic joint
    double value = 0;     ///< of a passive joint
    bool moves = false;   ///< not a fixed joint
    bool slides = false;  ///< prismatic
    Eigen::Vector3d axis_W = Eigen::Vector3d::Zero();
    Eigen::Vector3d p_WJ = Eigen::Vector3d::Zero();
  };

  void joint_columns(int link, const Eigen::Vector3d& p_WP, Eigen::Ref<Eigen::MatrixXd> J,
                     Eigen::Index first) const noexcept;
  void com_columns(Eigen::Ref<Eigen::MatrixXd> J, Eigen::Index first) const noexcept;

  const RobotModel* model_;
  std::vector<JointState> joints_;
  std::vector<int> joint_of_dof_;
  Eigen::Isometry3d X_WB_ = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Isometry3d> X_WL_;
  std::vector<double> subtree_mass_;             ///< of each link with everything it carries
  std::vector<Eigen::Vector3d> subtree_moment_;  ///< mass times position in W
  double mass_ = 0;
  double payload_mass_ = 0;
  int payload_link_ = 0;
  Eigen::Vector3d p_LP_payload_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_Wcm_ = Eigen::Vector3d::Zero();
};

}  // namespace walkman::motion
