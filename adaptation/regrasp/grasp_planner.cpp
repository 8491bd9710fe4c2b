#include "adaptation/regrasp/grasp_planner.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include <fmt/format.h>

#include "adaptation/regrasp/observer.h"
#include "adaptation/regrasp/route.h"
#include "adaptation/regrasp/surroundings.h"
#include "urdf/reader/kinematics.h"

namespace walkman::regrasp {
namespace {

constexpr double kSearchStep = 0.001;  // m along a handle
constexpr double kPlaceStep = 0.002;   // m, places closer than half of this are the same
constexpr double kPlaceGrowth = 0.25;  // share of the distance from the best place, where that is more
constexpr std::array<double, 5> kPitches = {0, 0.35, -0.35, 0.7, -0.7};  // rad, upright first
constexpr int kClosingSteps = 8;
constexpr int kDescentSteps = 4;
constexpr double kLastStretch = 0.06;  // m above the grasp, where the open fingers pass the handle
constexpr double kOnHandle = 0.012;    // m, points this close to a handle's surface belong to it
constexpr double kFingerRoom = 0.002;  // m between a finger and the table
// m between the hand and anything beside the handle: twice the offset of a hand from where the camera sees
// it, and what fingers keep from the table if the hand would otherwise be too far from the desired place
constexpr double kBesideRoom = 0.006;
constexpr double kLeastBesideRoom = 0.002;
constexpr const char* kBeside = "what lies beside the handle";
constexpr double kNoGrasp = -1;
constexpr double kWorthLeaving = 0.25;     // extra room that outweighs a straighter grasp or the first hand
constexpr double kWayStep = 0.02;          // m, of the hand's way over the object; a finger is as thick
constexpr double kHandReach = 0.3;         // m, beyond all parts of the open hand
constexpr std::size_t kMostPoints = 1500;  // of the object, so that they are closer than a finger is thick
constexpr std::size_t kWayOver = 2;        // poses of an approach until the hand is above the grasp
constexpr std::size_t kFewPitches = 3;     // of those above, tried beyond the best place

Eigen::Isometry3d turned_about_handle(const Eigen::Isometry3d& X_TG, double radius, double pitch) {
  const Eigen::Translation3d to_axis(0, -radius, 0);
  return X_TG * to_axis * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitX()) * to_axis.inverse();
}

/// Shapes of a hand's palm, wrist and fingers in its frame H, with its motor from open to closed.
std::vector<std::vector<motion::BodyShape>> closing_hand(const RobotModel& model, const HandParts& hand) {
  motion::KinematicTree posed(model, {});
  const int frame = model.link_index(hand.frame);
  const std::vector<std::size_t> links =
      links_below(model, static_cast<std::size_t>(model.link_index(hand.force_torque)));
  const double travel = model.joints[static_cast<std::size_t>(model.joint_index(hand.motor))].limits.upper;
  std::vector<std::vector<motion::BodyShape>> steps;
  for (int step = 0; step <= kClosingSteps; ++step) {
    posed.set_passive(hand.motor, travel * step / kClosingSteps);
    posed.update(Eigen::VectorXd::Zero(0));
    steps.emplace_back();
    for (motion::BodyShape shape : motion::body_shapes(model)) {
      if (std::find(links.begin(), links.end(), static_cast<std::size_t>(shape.link)) == links.end())
        continue;
      shape.X_LS = posed.X_WL(frame).inverse() * posed.X_WL(shape.link) * shape.X_LS;
      steps.back().push_back(shape);
    }
  }
  return steps;
}

double distance(const motion::BodyShape& shape, const Eigen::Isometry3d& X_SH, const Eigen::Vector3d& p_H) {
  const Eigen::Vector3d p_S = X_SH * p_H;
  return (p_S - shape.nearest_S(p_S)).norm() - shape.rounding;
}

}  // namespace

std::vector<Eigen::Isometry3d> approach_way(const Eigen::Isometry3d& X_TG, double clearance,
                                            const StageTwoParameters& parameters) {
  const Eigen::Isometry3d over = X_TG * Eigen::Translation3d(0, parameters.approach_height, 0);
  Eigen::Isometry3d behind = over;
  behind.translation().x() -= parameters.approach_back;
  return {behind, over, X_TG * Eigen::Translation3d(0, clearance, 0)};
}

GraspPlanner::GraspPlanner(const KnownRobot& known, const std::vector<std::string>& joint_names,
                           const std::optional<motion::Stance>& stance, const MethodParameters& parameters)
    : known_(known), parameters_(parameters) {
  for (const HandParts& parts : known.description.working_hands()) {
    motion::HandMotionOptions options = motion::hand_motion_options(known, parts);
    options.margins = wider(options.margins);
    hands_.push_back(std::unique_ptr<Hand>(
        stance
            ? new Hand{motion::HandMotion(known.model, joint_names, *stance, options),
                       closing_hand(known.model, parts)}
            : new Hand{motion::HandMotion(known.model, joint_names, Eigen::Isometry3d::Identity(), options),
                       closing_hand(known.model, parts)}));
  }
}

std::vector<GraspPlanner::Place> GraspPlanner::places(const View& view, const Cost& cost) const {
  std::vector<Place> all;
  const auto& handles = view.seen->object().handles;
  for (std::size_t i = 0; i < handles.size(); ++i) {
    const perception::Handle& handle = handles[i];
    const auto add = [&](double along) {
      const double place = handle.nearest_graspable(along);
      all.push_back({static_cast<int>(i), place, cost(handle, place)});
    };
    // The best place itself, and others at increasing distances from it.
    double best = handle.nearest_graspable(handle.from);
    const int steps = static_cast<int>((handle.to - handle.from) / kSearchStep);
    for (int step = 0; step <= steps; ++step) {
      const double place = handle.nearest_graspable(handle.from + step * kSearchStep);
      if (cost(handle, place) < cost(handle, best)) best = place;
    }
    add(best);
    double away = kPlaceStep;
    while (away <= handle.to - handle.from) {
      if (best + away <= handle.to) add(best + away);
      if (best - away >= handle.from) add(best - away);
      away += std::max(kPlaceStep, kPlaceGrowth * away);
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const Place& a, const Place& b) { return a.cost < b.cost; });
  all.erase(std::unique(all.begin(), all.end(),
                        [](const Place& a, const Place& b) {
                          return a.handle == b.handle && std::abs(a.along - b.along) < kPlaceStep / 2;
                        }),
            all.end());
  return all;
}

/// Returns what the hand would touch there; empty if nothing.
GraspPlanner::Refusal GraspPlanner::touching(const View& view, const Hand& hand, const Place& place,
                                             double beside_room, const Eigen::Isometry3d& X_TEnd) const {
  const perception::Handle& handle = view.seen->object().handles[static_cast<std::size_t>(place.handle)];
  const perception::Plane& plane = view.seen->plane;
  const Eigen::Vector3d n_T = view.X_TC.linear() * plane.n_C;
  const double offset = plane.offset - n_T.dot(view.X_TC.translation());
  // Points other than the handle's that the hand could reach.
  std::vector<Eigen::Vector3d> others_T;
  const double range = 0.3 + kLastStretch;
  for (const perception::SeenObject& object : view.seen->objects) {
    for (const Eigen::Vector3f& p : object.surface_C) {
      const Eigen::Vector3d from_middle = p.cast<double>() - handle.p_CM;
      const double along = handle.axis_C.dot(from_middle);
      const double off_axis = (from_middle - along * handle.axis_C).norm();
      // Just beyond its ends the handle continues, or something thicker begins.
      const bool between = along > handle.from && along < handle.to;
      if (off_axis < handle.radius + (between ? kOnHandle : kOnHandle / 2) &&
          along > handle.from - kOnHandle && along < handle.to + kOnHandle)
        continue;
      const Eigen::Vector3d p_T = view.X_TC * p.cast<double>();
      if ((p_T - X_TEnd.translation()).norm() < range) others_T.push_back(p_T);
    }
  }
  const Eigen::Vector3d axis_point_T = view.X_TC * (handle.p_CM + place.along * handle.axis_C);
  const Eigen::Vector3d axis_T = view.X_TC.linear() * handle.axis_C;
  const auto touched = [&](const std::vector<motion::BodyShape>& shapes, const Eigen::Isometry3d& X_TH,
                           bool table) {
    double least = 0;
    Refusal refusal;
    const auto found = [&](const motion::BodyShape& shape, const char* other, double over) {
      if (over >= least) return;
      least = over;
      refusal.beside = std::string_view(other) == kBeside;
      refusal.reason =
          fmt::format("{} and {} would touch, {:.1f} mm too near",
                      known_.model.links[static_cast<std::size_t>(shape.link)].name, other, -1e3 * over);
    };
    for (const motion::BodyShape& shape : shapes) {
      const Eigen::Isometry3d X_TS = X_TH * shape.X_LS;
      if (table)
        found(shape, "the table",
              n_T.dot(X_TS.translation()) + offset - shape.reach(-(X_TS.linear().transpose() * n_T)) -
                  kFingerRoom);
      const Eigen::Isometry3d X_ST = X_TS.inverse();
      const double near = shape.extent() + beside_room;
      for (const Eigen::Vector3d& p_T : others_T) {
        if ((p_T - X_TS.translation()).squaredNorm() < near * near)
          found(shape, kBeside, distance(shape, X_ST, p_T) - beside_room);
      }
    }
    return refusal;
  };
  const auto around_handle = [&](const motion::BodyShape& shape) {
    const Eigen::Vector3d from_axis = (X_TEnd * shape.X_LS).translation() - axis_point_T;
    return (from_axis - axis_T.dot(from_axis) * axis_T).norm() < handle.radius;
  };
  for (int step = kDescentSteps; step >= 0; --step) {
    const Eigen::Isometry3d X_TH = X_TEnd * Eigen::Translation3d(0, kLastStretch * step / kDescentSteps, 0);
    const Refusal on_the_way = touched(hand.closing.front(), X_TH, true);
    if (on_the_way.reason.empty()) continue;
    // The overlap at the grasp says more than where it begins.
    const Refusal there = touched(hand.closing.front(), X_TEnd, true);
    return there.reason.empty() ? on_the_way : there;
  }
  // Closing fingers may slide along the table: they are soft, and a low handle cannot be held in any other
  // way. Open fingers that lie on it would close above a handle, not around it.
  for (const auto& shapes : hand.closing) {
    if (std::any_of(shapes.begin(), shapes.end(), around_handle)) break;  // the handle stops them by then
    if (Refusal closing = touched(shapes, X_TEnd, false); !closing.reason.empty()) return closing;
  }
  return {};
}

/// The handle itself is no obstacle to the motion, so that the hand can come close to it from above: a hand
/// that is turned about it may come over the object from behind.
GraspPlanner::Refusal GraspPlanner::crossing(const View& view, const Hand& hand,
                                             const std::vector<Eigen::Isometry3d>& way) const {
  const std::vector<Eigen::Vector3f>& surface_C = view.seen->object().surface_C;
  std::vector<Eigen::Vector3d> object_T;
  Eigen::AlignedBox3d box_T;
  for (std::size_t i = 0; i < surface_C.size(); i += 1 + surface_C.size() / kMostPoints) {
    object_T.push_back(view.X_TC * surface_C[i].cast<double>());
    box_T.extend(object_T.back());
  }
  const auto touching_at = [&](const Eigen::Isometry3d& X_TH) -> Refusal {
    if (box_T.exteriorDistance(X_TH.translation()) > kHandReach) return {};
    for (const motion::BodyShape& shape : hand.closing.front()) {
      const Eigen::Isometry3d X_TS = X_TH * shape.X_LS;
      const Eigen::Isometry3d X_ST = X_TS.inverse();
      const double near = shape.extent();
      for (const Eigen::Vector3d& p_T : object_T) {
        if ((p_T - X_TS.translation()).squaredNorm() > near * near || distance(shape, X_ST, p_T) > 0)
          continue;
        return {fmt::format("{} would push the object on the way over it",
                            known_.model.links[static_cast<std::size_t>(shape.link)].name),
                false, true};
      }
    }
    return {};
  };
  Eigen::Isometry3d X_TFrom = hand.motion.X_WH();
  for (const Eigen::Isometry3d& X_TTo : way) {
    const double length = (X_TTo.translation() - X_TFrom.translation()).norm();
    const int steps = 1 + static_cast<int>(length / kWayStep);
    const Eigen::Quaterniond from(X_TFrom.linear()), to(X_TTo.linear());
    for (int step = 1; step <= steps; ++step) {
      const double share = static_cast<double>(step) / steps;
      Eigen::Isometry3d X_TH(from.slerp(share, to));
      X_TH.translation() = X_TFrom.translation() + share * (X_TTo.translation() - X_TFrom.translation());
      if (Refusal found = touching_at(X_TH); !found.reason.empty()) return found;
    }
    X_TFrom = X_TTo;
  }
  return {};
}

double GraspPlanner::judge(const View& view, Hand& hand, const Place& place, double beside_room,
                           PlannedGrasp& grasp, Refusal& refusal) {
  std::vector<Eigen::Isometry3d> way =
      approach_way(grasp.X_TG, parameters_.stage_two.palm_clearance, parameters_.stage_two);
  grasp.X_TH = way.back();
  for (const Blocked& blocked : view.blocked) {
    const double apart = (blocked.p_TG - grasp.X_TG.translation()).norm();
    if (blocked.hand != grasp.hand || apart > parameters_.stage_two.displacement_threshold) continue;
    refusal = {blocked.reason, false, true};
    return kNoGrasp;
  }
  refusal = touching(view, hand, place, beside_room, grasp.X_TH);
  if (!refusal.reason.empty()) return kNoGrasp;
  grasp.obstacles = view.obstacles;
  for (motion::NamedObstacle& part : rest_of_object(*view.seen, place.handle, place.along, view.X_TC))
    grasp.obstacles.push_back(std::move(part));
  hand.motion.set_obstacles(grasp.obstacles);
  hand.motion.reset(view.q, view.q_stood);
  Eigen::Isometry3d lifted = way.back();
  lifted.translation().z() += parameters_.stage_two.lift_max;
  way.push_back(lifted);
  for (const double turn : {-1.0, 1.0}) {
    way.push_back(lifted *
                  Eigen::AngleAxisd(turn * parameters_.stage_two.weighing_turn, Eigen::Vector3d::UnitX()));
  }
  motion::MotionLimits limits;
  limits.linear_velocity = parameters_.stage_two.travel_speed;
  limits.angular_velocity = parameters_.stage_two.angular_speed;
  const std::size_t beyond = way.size() - kWayOver;
  Route route = find_route(hand.motion, way, limits, 1, hand.led);
  if (route.reach.status != motion::HandMotion::Status::kReached) {
    refusal.reason = route.reach.reason;
    refusal.no_way = true;
    return kNoGrasp;
  }
  grasp.way = std::move(route.way);
  grasp.way.resize(grasp.way.size() - beyond);
  refusal = crossing(view, hand, grasp.way);
  if (!refusal.reason.empty()) return kNoGrasp;
  return room_of(route.reach);
}

PlannedGrasp GraspPlanner::planned_at(const View& view, const Place& place, std::size_t hand, double pitch) {
  PlannedGrasp grasp;
  grasp.hand = hand;
  grasp.pitch = pitch;
  grasp.cost = place.cost;
  grasp.radius = view.seen->object().handles[static_cast<std::size_t>(place.handle)].radius;
  const Eigen::Isometry3d X_TUpright =
      view.X_TC * perception::grasp_frame_at(*view.seen, place.handle, place.along).X_CG;
  grasp.X_TG = turned_about_handle(X_TUpright, grasp.radius, pitch);
  return grasp;
}

std::optional<PlannedGrasp> GraspPlanner::grasp_at(const View& view, const Place& place, std::size_t pitches,
                                                   double beside_room, Refusals& refusals) {
  std::optional<PlannedGrasp> best;
  double best_room = kNoGrasp;
  for (std::size_t turn = 0; turn < pitches && best_room < 1; ++turn) {
    for (std::size_t hand = 0; hand < hands_.size() && best_room < 1; ++hand) {
      PlannedGrasp grasp = planned_at(view, place, hand, kPitches[turn]);
      Refusal refusal;
      const double room = judge(view, *hands_[hand], place, beside_room, grasp, refusal);
      if (room < 0 && refusals.first[hand].empty()) refusals.first[hand] = refusal.reason;
      refusals.beside = refusals.beside || (room < 0 && refusal.beside);
      if (room < 0 && refusal.no_way) refusals.unreached_cost = std::min(refusals.unreached_cost, place.cost);
      if (room <= best_room + (best_room < 0 ? 0 : kWorthLeaving)) continue;
      best_room = room;
      best = std::move(grasp);
    }
  }
  return best;
}

PlannedGrasp GraspPlanner::nearest(const View& view, const Cost& cost, const std::vector<Place>& all,
                                   const Place& place, double beside_room, PlannedGrasp grasp) {
  double along = place.along, refused = std::numeric_limits<double>::infinity();
  for (const Place& other : all) {
    if (&other == &place) break;
    if (other.handle == place.handle && std::abs(other.along - along) < std::abs(refused - along))
      refused = other.along;
  }
  if (!std::isfinite(refused)) return grasp;
  const perception::Handle& handle = view.seen->object().handles[static_cast<std::size_t>(place.handle)];
  while (std::abs(along - refused) > kPlaceStep) {
    const double middle = (along + refused) / 2;
    const Place between{place.handle, middle, cost(handle, middle)};
    PlannedGrasp next = planned_at(view, between, grasp.hand, grasp.pitch);
    Refusal refusal;
    const bool can_be = handle.nearest_graspable(middle) == middle &&
                        judge(view, *hands_[grasp.hand], between, beside_room, next, refusal) >= 0;
    (can_be ? along : refused) = middle;
    if (can_be) grasp = std::move(next);
  }
  return grasp;
}

PlannedGrasp GraspPlanner::plan(const View& view, const Cost& cost, double nearer_than) {
  const std::vector<Place> all = places(view, cost);
  Refusals refusals{std::vector<std::string>(hands_.size())};
  const auto planned = [&](PlannedGrasp grasp) {
    std::vector<Eigen::Isometry3d>& led = hands_[grasp.hand]->led;
    led.assign(grasp.way.begin(), grasp.way.end() - kWayOver);
    grasp.least_cost = all.front().cost;
    grasp.unreached_cost = refusals.unreached_cost;
    if (grasp.cost > all.front().cost) grasp.refusal = both_hands(refusals.first);
    return grasp;
  };
  // The method chooses the place; the choice of hand and rotation depends on the room.
  const double what_counts = parameters_.stage_two.displacement_threshold;
  std::optional<PlannedGrasp> close;  // the nearest one, with little room beside the handle
  const Place* close_place = nullptr;
  double farthest = nearer_than;
  for (const Place& place : all) {
    if (place.cost >= farthest) break;
    const std::size_t pitches = &place == &all.front() ? kPitches.size() : kFewPitches;
    refusals.beside = false;
    if (std::optional<PlannedGrasp> grasp = grasp_at(view, place, pitches, kBesideRoom, refusals))
      return planned(nearest(view, cost, all, place, kBesideRoom, std::move(*grasp)));
    if (close || !refusals.beside) continue;
    close = grasp_at(view, place, pitches, kLeastBesideRoom, refusals);
    close_place = &place;
    // More room is not worth a place that would require a regrasp, or that is farther away by the
    // displacement threshold.
    if (close)
      farthest = std::min(farthest, close->cost <= what_counts ? what_counts : close->cost + what_counts);
  }
  if (close) return planned(nearest(view, cost, all, *close_place, kLeastBesideRoom, std::move(*close)));
  throw RunStopped(fmt::format("no hand can grasp the object{}; at the best place, straight down, {}",
                               std::isfinite(nearer_than)
                                   ? fmt::format(" within {:.0f} mm of its centre of mass", 1e3 * nearer_than)
                                   : "",
                               both_hands(refusals.first)));
}

std::string GraspPlanner::both_hands(const std::vector<std::string>& refusals) const {
  std::string text;
  for (std::size_t hand = 0; hand < hands_.size(); ++hand) {
    text += fmt::format("{}the {} hand: {}", hand == 0 ? "" : "; ", known_.description.hands[hand].name,
                        refusals[hand].empty() ? "no place is that close" : refusals[hand]);
  }
  return text;
}

}  // namespace walkman::regrasp
