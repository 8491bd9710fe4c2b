#include "adaptation/regrasp/route.h"

#include <algorithm>
#include <cmath>

namespace walkman::regrasp {
namespace {

// A motion with this much room is good enough: rad, m. The guards keep 12 mm from obstacles and 6 mm from the
// robot itself, part of which is taken up by turning.
constexpr double kEnoughLimit = 0.05, kEnoughRoom = 0.009, kEnoughOwnRoom = 0.005;

constexpr double kPlannedRoom = 0.004;  // m; half of it between the robot's own links
constexpr double kOver = 0.15;          // m above the hand's target, with open fingers

Eigen::Isometry3d moved(const Eigen::Isometry3d& X_T, const Eigen::Vector3d& by) {
  Eigen::Isometry3d out = X_T;
  out.translation() += by;
  return out;
}

/// Via points between two poses, shortest detour first. `side`: 1 for an arm on the left, −1 on the right.
std::vector<std::vector<Eigen::Isometry3d>> detours(const Eigen::Isometry3d& X_TFrom,
                                                    const Eigen::Isometry3d& X_TTo, double side) {
  std::vector<std::vector<Eigen::Isometry3d>> out;
  for (const double lift : {0.10, 0.25}) {  // m
    const double top = std::max(X_TFrom.translation().z(), X_TTo.translation().z()) + lift;
    const auto at_top = [top](const Eigen::Isometry3d& X_T) {
      return moved(X_T, {0, 0, top - X_T.translation().z()});
    };
    out.push_back({at_top(X_TFrom), at_top(X_TTo)});
  }
  for (const double aside : {0.15, 0.30}) {
    const double outer = side * std::max(side * X_TFrom.translation().y(), side * X_TTo.translation().y());
    const auto out_there = [&](const Eigen::Isometry3d& X_T) {
      return moved(X_T, {0, outer + side * aside - X_T.translation().y(), 0.05});
    };
    out.push_back({out_there(X_TTo)});
    out.push_back({out_there(X_TFrom), out_there(X_TTo)});
    // Out, up and in: around the near corner of a table as high as the hand.
    const Eigen::Isometry3d over = moved(X_TTo, {0, 0, kOver});
    const Eigen::Isometry3d beside = out_there(X_TFrom);
    out.push_back({beside, moved(beside, {0, 0, over.translation().z() - beside.translation().z()}), over});
  }
  return out;
}

/// Width of the way, as a share of what is sufficient.
double width_of(const motion::HandMotion::Reach& reach) {
  return std::clamp(std::min(reach.own_clearance / kEnoughOwnRoom, reach.obstacle_clearance / kEnoughRoom),
                    0.0, 1.0);
}

}  // namespace

double room_of(const motion::HandMotion::Reach& reach) {
  return std::min(std::clamp(reach.limit_margin / kEnoughLimit, 0.0, 1.0), width_of(reach));
}

motion::GuardMargins wider(motion::GuardMargins least) {
  least.own += kPlannedRoom / 2;
  least.arm += kPlannedRoom;
  least.idle += kPlannedRoom;
  return least;
}

Route straight_route(motion::HandMotion& hand, std::span<const Eigen::Isometry3d> way,
                     const motion::MotionLimits& limits) {
  return {{way.begin(), way.end()}, hand.reachable(way, limits)};
}

Route find_route(motion::HandMotion& hand, std::span<const Eigen::Isometry3d> way,
                 const motion::MotionLimits& limits, double enough, std::span<const Eigen::Isometry3d> led) {
  using Status = motion::HandMotion::Status;
  Route best = straight_route(hand, way, limits);
  bool reached = best.reach.status == Status::kReached;
  if (reached && width_of(best.reach) >= enough) return best;
  const double side = std::copysign(1.0, hand.shoulder().y());
  std::vector<std::vector<Eigen::Isometry3d>> vias = detours(hand.X_WH(), way.front(), side);
  if (!led.empty()) vias.insert(vias.begin(), {led.begin(), led.end()});
  for (std::vector<Eigen::Isometry3d>& via : vias) {
    via.insert(via.end(), way.begin(), way.end());
    motion::HandMotion::Reach reach = hand.reachable(via, limits);
    if (reach.status != Status::kReached) continue;
    if (reached && width_of(reach) <= width_of(best.reach)) continue;
    best = {std::move(via), std::move(reach)};
    reached = true;
    if (width_of(best.reach) >= enough) break;
  }
  return best;
}

}  // namespace walkman::regrasp
