#pragma once

#include <array>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "adaptation/motion/body_shape.h"
#include "adaptation/motion/kinematic_tree.h"
#include "adaptation/motion/obstacle.h"

namespace walkman::motion {

class WholeBodyIk;

/// Clearances to keep between monitored shapes, m.
struct GuardMargins {
  /// Between the robot's own links, which are known better than a table. At home a shoulder is 19 mm from the
  /// head.
  double own = 0.006;
  double arm = 0.012;   ///< between the working arm and obstacles
  double idle = 0.022;  ///< for everything else, which need not be near
  /// Angle by which the torso may be off its reference, rad: the overshoot of a stop from the waist's
  /// 0.3 rad/s in a body that sways about the vertical with a period of 0.6 s.
  double turn = 0.03;
};

/// An obstacle and its name in messages.
struct NamedObstacle {
  std::string name;
  ConvexPrism prism;
};

/// Keeps a robot's links apart from each other and from obstacles, using the collision shapes of its URDF.
///
/// Links are monitored if one of the active joints moves them relative to each other. Links connected by a
/// joint, and pairs that the SRDF disables, are not monitored. Only `set_obstacles` allocates after
/// construction.
class BodyGuard {
 public:
  /// Keeps a reference to `kinematics`. `moving`: degrees of freedom that may move; `base_moves`: whether the
  /// root link does; the working arm extends from the link `shoulder` to `hand_link`. The links that the
  /// joint `twist` carries (empty: none) are treated as turned about it by a further margins.turn, in either
  /// direction. Throws std::out_of_range for an unknown link in `disabled`.
  BodyGuard(const KinematicTree& kinematics, const std::vector<int>& moving, bool base_moves, int shoulder,
            const std::string& hand_link, const std::string& twist,
            const std::vector<std::pair<std::string, std::string>>& disabled, const GuardMargins& margins);

  void set_obstacles(std::vector<NamedObstacle> obstacles) { obstacles_ = std::move(obstacles); }
  /// Replaces the margins given to the constructor.
  void set_margins(const GuardMargins& margins) noexcept { margins_ = margins; }

  /// A part of the robot close to something else.
  struct Nearness {
    Separation gap;  ///< from `other` to `shape`
    int shape = -1;  ///< index of the robot's part
    int other = -1;  ///< index of its other part, −1 for an obstacle
    int obstacle = -1;
  };

  /// Finds what is near in the present pose of `kinematics`. The fingers of the working hand are included
  /// only if `with_fingers`, and only in near().
  void update(bool with_fingers = false) noexcept;
  /// Clearance from obstacles (m) that the working hand's fingers can keep while they are moved by `X_WW`:
  /// that of the arm, or less if they end up nearer; negative if they end up in one.
  [[nodiscard]] double finger_margin(const Eigen::Isometry3d& X_WW) const noexcept;
  /// What the last update found, nearest first; at most kMostNear.
  [[nodiscard]] std::span<const Nearness> near() const { return {near_.data(), near_count_}; }
  /// Keeps everything in near() apart by its margin: approaches it at no more than `gain` (1/s) times the
  /// remaining distance, and not at all once closer. Adds one row for each of near(), in their order.
  void keep_apart(WholeBodyIk& ik, double finger_margin, double gain) const noexcept;

  /// Minimum distances at the last update, m, capped at kFarthest. Infinite without obstacles.
  [[nodiscard]] double own_clearance() const { return own_clearance_; }
  [[nodiscard]] double obstacle_clearance() const { return obstacle_clearance_; }

  /// Names the two: "RForearm and the robot's own Waist", "RForearm and the table".
  [[nodiscard]] std::string describe(const Nearness& nearness) const;

  static constexpr std::size_t kMostNear = 24;
  static constexpr double kFarthest = 0.12;  ///< m, anything farther away needs no row

 private:
  /// Two shapes, the direction of their largest separation when it was last computed, and their present
  /// distance, infinite if it was not worth computing.
  struct Pair {
    int shape, other;
    Eigen::Vector3d n_W = Eigen::Vector3d::Zero();
    double distance = 0;
  };

  void add(const Nearness& nearness) noexcept;
  /// Distance from which a pair is of no interest, m: the list is full of nearer ones.
  [[nodiscard]] double enough() const noexcept {
    return near_count_ == kMostNear ? near_.back().gap.distance : kFarthest;
  }
  void look_at(Pair& pair) noexcept;
  /// How much nearer the two come when the links that `twist` carries are turned by margins.turn, m.
  [[nodiscard]] double turned(const Nearness& nearness) const noexcept;
  /// Separation from an obstacle to a shape at X_WS, if less than kFarthest; otherwise just enough to know
  /// that it is not.
  [[nodiscard]] Separation gap_to(std::size_t obstacle, int shape,
                                  const Eigen::Isometry3d& X_WS) const noexcept;

  const KinematicTree* kinematics_;
  std::vector<BodyShape> shapes_;
  std::vector<double> extents_;
  std::vector<Eigen::Isometry3d> X_WS_;
  std::vector<Pair> pairs_;             // those of near() first
  std::vector<int> against_obstacles_;  // shapes
  std::vector<int> fingers_;            // shapes of the working hand's fingers
  int twist_ = -1;                      // joint
  std::vector<bool> is_turned_;         // by that joint, for each shape
  GuardMargins margins_;
  std::vector<bool> of_arm_;  // the working one, for each shape
  std::vector<NamedObstacle> obstacles_;
  std::array<Nearness, kMostNear> near_;
  std::size_t near_count_ = 0;
  double own_clearance_ = kFarthest, obstacle_clearance_ = kFarthest;
};

}  // namespace walkman::motion
