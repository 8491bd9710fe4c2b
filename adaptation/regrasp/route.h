#pragma once

#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "adaptation/motion/hand_motion.h"

namespace walkman::regrasp {

/// Poses of the hand, one after the other in straight lines.
struct Route {
  std::vector<Eigen::Isometry3d> way;
  motion::HandMotion::Reach reach;  ///< kReached when all of them are
};

/// How much room a motion leaves to joints' limits and to what is near, as a share of what needs no more:
/// 0 .. 1.
[[nodiscard]] double room_of(const motion::HandMotion::Reach& reach);

/// With what a way is looked for first: more than the motions have to keep at least, which may come another
/// way.
[[nodiscard]] motion::GuardMargins wider(motion::GuardMargins least);

/// From where the hand is through the poses `way`, run ahead. Moves nothing; not for cyclic code.
[[nodiscard]] Route straight_route(motion::HandMotion& hand, std::span<const Eigen::Isometry3d> way,
                                   const motion::MotionLimits& limits);

/// The same; straight to the first of them if nothing comes nearer on the way than that share of what needs
/// no more, `enough`; otherwise by the via points that keep farthest away: those that `led` nearby before
/// (none if empty), up, across and down, or round to the arm's own side, away from the trunk. The route's
/// reach is that of the straight way when none of them helps.
[[nodiscard]] Route find_route(motion::HandMotion& hand, std::span<const Eigen::Isometry3d> way,
                               const motion::MotionLimits& limits, double enough,
                               std::span<const Eigen::Isometry3d> led = {});

}  // namespace walkman::regrasp
