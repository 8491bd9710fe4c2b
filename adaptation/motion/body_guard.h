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

/// How far what is watched stays apart, m.
struct GuardMargins {
  /// The robot's own links, which are known better than a table. At home a shoulder is 19 mm off the head.
  double own = 0.006;
  double arm = 0.012;   ///< of the arm that works, from obstacles
  double idle = 0.022;  ///< of all else, which need not be near
  /// By which the torso may be turned beside its reference, rad: what stops at the waist's 0.3 rad/s in a
  /// body that sways about the vertical with a period of 0.6 s.
  double turn = 0.03;
};

/// An obstacle and what people call it.
struct NamedObstacle {
  std::string name;
  ConvexPrism prism;
};

/// Keeps a robot's links apart from each other and from obstacles, by the collision shapes of its URDF.
///
/// Links are watched when one of the active joints moves them against each other. Not watched are links that
/// a joint joins, and pairs that the SRDF disables. Only `set_obstacles` allocates after construction.
class BodyGuard {
 public:
  /// Keeps a reference to `kinematics`. `moving` are the degrees of freedom that may move, `base_moves`
  /// whether the root link does; the arm that works goes from the link `shoulder` to `hand_link`. What
  /// the joint `twist` carries (empty: none) counts as turned about it by margins.turn more than it is,
  /// either way. Throws std::out_of_range for a link in `disabled` that is not there.
  BodyGuard(const KinematicTree& kinematics, const std::vector<int>& moving, bool base_moves, int shoulder,
            const std::string& hand_link, const std::string& twist,
            const std::vector<std::pair<std::string, std::string>>& disabled, const GuardMargins& margins);

  void set_obstacles(std::vector<NamedObstacle> obstacles) { obstacles_ = std::move(obstacles); }
  /// In place of those given to the constructor.
  void set_margins(const GuardMargins& margins) noexcept { margins_ = margins; }

  /// Something of the robot next to something else.
  struct Nearness {
    Separation gap;  ///< from `other` to `shape`
    int shape = -1;  ///< index of the robot's part
    int other = -1;  ///< of its other part, −1 for an obstacle
    int obstacle = -1;
  };

  /// Finds what is near as `kinematics` is posed now. The fingers of the working hand count with
  /// `with_fingers` alone, and in near() alone.
  void update(bool with_fingers = false) noexcept;
  /// How far the working hand's fingers can keep off obstacles (m) on the way to where they are moved by
  /// `X_WW`: as far as the arm, or less when they end nearer; negative when they end in one.
  [[nodiscard]] double finger_margin(const Eigen::Isometry3d& X_WW) const noexcept;
  /// Since the last update, nearest first; at most kMostNear.
  [[nodiscard]] std::span<const Nearness> near() const { return {near_.data(), near_count_}; }
  /// Keeps everything near apart: by its margin, approached at most at `gain` (1/s) times what is left to it,
  /// and not at all when it is closer already. Adds one row for each of near(), in their order.
  void keep_apart(WholeBodyIk& ik, double finger_margin, double gain) const noexcept;

  /// Least distances at the last update, m; what is farther than kFarthest counts as that. Infinite without
  /// obstacles.
  [[nodiscard]] double own_clearance() const { return own_clearance_; }
  [[nodiscard]] double obstacle_clearance() const { return obstacle_clearance_; }

  /// "RForearm and the robot's own Waist", "RForearm and the table".
  [[nodiscard]] std::string describe(const Nearness& nearness) const;

  static constexpr std::size_t kMostNear = 24;
  static constexpr double kFarthest = 0.12;  ///< m, what is farther away needs no row

 private:
  /// Two shapes, the direction in which they were farthest apart when that was last found, and how far they
  /// are apart now, infinite when that was not worth finding.
  struct Pair {
    int shape, other;
    Eigen::Vector3d n_W = Eigen::Vector3d::Zero();
    double distance = 0;
  };

  void add(const Nearness& nearness) noexcept;
  /// From this distance on a pair is of no interest, m: the list is full of nearer ones.
  [[nodiscard]] double enough() const noexcept {
    return near_count_ == kMostNear ? near_.back().gap.distance : kFarthest;
  }
  void look_at(Pair& pair) noexcept;
  /// How much nearer the two come when what `twist` carries is turned by margins.turn, m.
  [[nodiscard]] double turned(const Nearness& nearness) const noexcept;
  /// From an obstacle to a shape there, less than kFarthest or what is enough to know that it is not.
  [[nodiscard]] Separation gap_to(std::size_t obstacle, int shape,
                                  const Eigen::Isometry3d& X_WS) const noexcept;

  const KinematicTree* kinematics_;
  std::vector<BodyShape> shapes_;
  std::vector<double> extents_;
  std::vector<Eigen::Isometry3d> X_WS_;
  std::vector<Pair> pairs_;             // those of near() first
  std::vector<int> against_obstacles_;  // shapes
  std::vector<int> fingers_;            // the same for the working hand's
  int twist_ = -1;                      // joint
  std::vector<bool> is_turned_;         // by it, of each shape
  GuardMargins margins_;
  std::vector<bool> of_arm_;  // that works, of each shape
  std::vector<NamedObstacle> obstacles_;
  std::array<Nearness, kMostNear> near_;
  std::size_t near_count_ = 0;
  double own_clearance_ = kFarthest, obstacle_clearance_ = kFarthest;
};

}  // namespace walkman::motion
