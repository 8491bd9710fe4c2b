#pragma once

#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "adaptation/motion/hand_motion.h"

namespace walkman::regrasp {

/// Hand poses joined by straight lines.
struct Route {
  std::vector<Eigen::Isometry3d> way;
  motion::HandMotion::Reach reach;  ///< kReached if all of them are
};

/// Clearance of a motion from joint limits and nearby objects, as a share of what is sufficient: 0 .. 1.
[[nodiscard]] double room_of(const motion::HandMotion::Reach& reach);

/// Margins with which a way is sought first: larger than motions must keep, because they may deviate from it.
[[nodiscard]] motion::GuardMargins wider(motion::GuardMargins least);

/// Route from the hand's present pose through the poses `way`, run ahead. Moves nothing; not for cyclic code.
[[nodiscard]] Route straight_route(motion::HandMotion& hand, std::span<const Eigen::Isometry3d> way,
                                   const motion::MotionLimits& limits);

/// As `straight_route`, going straight to the first pose if the clearance on the way is at least the share
/// `enough` of what is sufficient; otherwise through the via points with the most clearance: those of `led`,
/// which led nearby before (none if empty), up, across and down, or around on the arm's own side, away from
/// the trunk. If none of them helps, the route's reach is that of the straight way.
[[nodiscard]] Route find_route(motion::HandMotion& hand, std::span<const Eigen::Isometry3d> way,
                               const motion::MotionLimits& limits, double enough,
                               std::span<const Eigen::Isometry3d> led = {});

}  // namespace walkman::regrasp
