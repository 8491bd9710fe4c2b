#pragma once

#include <array>
#include <string>

#include <Eigen/Geometry>

namespace walkman::motion {

class WholeBodyIk;

/// How far the base of a robot that stands may leave the pose it stood up in. Its arms reach farther with it,
/// but legs far from there sway more, and their springs and sensors carry more.
struct BaseRoomOptions {
  double horizontal = 0.15;  ///< m: its weight behind the feet balances the arms before them
  double down = 0.10;        ///< m
  double up = 0.01;          ///< m; the knees are nearly straight
  double lean = 0.15;        ///< rad
  double turn = 0.15;        ///< rad
};

/// Keeps the base of a reference in its room by inequalities. Allocates nothing but for `describe`.
class BaseRoom {
 public:
  static constexpr std::size_t kBounds = 12;

  explicit BaseRoom(const BaseRoomOptions& options = {});

  /// The room is around this pose from now on.
  void reset(const Eigen::Isometry3d& X_WB) noexcept { X_WB0_ = X_WB; }

  /// Adds kBounds rows: each bound is approached at most at `gain` (1/s) times what is left to it.
  void keep(WholeBodyIk& ik, int base_link, const Eigen::Isometry3d& X_WB, double gain) const noexcept;
  /// Of the row of that number: "the base is as far forward as it may go, 150 mm".
  [[nodiscard]] std::string describe(int bound) const;

 private:
  struct Bound {
    Eigen::Vector3d p_BP;   // of the base
    Eigen::Vector3d n_W;    // along which it may not go on
    double room = 0;        // m
    bool relative = false;  // to the base's origin: an angle
  };
  std::array<Bound, kBounds> bounds_;
  Eigen::Isometry3d X_WB0_ = Eigen::Isometry3d::Identity();
};

}  // namespace walkman::motion
