#pragma once

#include <array>
#include <string>

#include <Eigen/Geometry>

namespace walkman::motion {

class WholeBodyIk;

/// How far the base of a standing robot may move from the pose it stood up in. Moving it extends the arms'
/// reach, but legs far from that pose sway more, and their springs and sensors carry more load.
struct BaseRoomOptions {
  double horizontal = 0.15;  ///< m: its weight behind the feet balances the arms in front of them
  double down = 0.10;        ///< m
  double up = 0.01;          ///< m; the knees are nearly straight
  double lean = 0.15;        ///< rad
  double turn = 0.15;        ///< rad
};

/// Keeps the base of a reference within these bounds by inequalities. Only `describe` allocates.
class BaseRoom {
 public:
  static constexpr std::size_t kBounds = 12;

  explicit BaseRoom(const BaseRoomOptions& options = {});

  /// Sets the pose that the bounds are relative to.
  void reset(const Eigen::Isometry3d& X_WB) noexcept { X_WB0_ = X_WB; }

  /// Adds kBounds rows: each bound is approached at no more than `gain` (1/s) times the remaining distance.
  void keep(WholeBodyIk& ik, int base_link, const Eigen::Isometry3d& X_WB, double gain) const noexcept;
  /// Describes the bound of the row with that index: "the base is at its limit of 150 mm forward".
  [[nodiscard]] std::string describe(int bound) const;

 private:
  struct Bound {
    Eigen::Vector3d p_BP;   // point of the base
    Eigen::Vector3d n_W;    // direction in which it is bounded
    double room = 0;        // m
    bool relative = false;  // measured from the base's origin: an angle
  };
  std::array<Bound, kBounds> bounds_;
  Eigen::Isometry3d X_WB0_ = Eigen::Isometry3d::Identity();
};

}  // namespace walkman::motion
