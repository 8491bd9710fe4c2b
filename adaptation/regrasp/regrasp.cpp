#include "adaptation/regrasp/regrasp.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <functional>
#include <future>
#include <limits>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

#include "adaptation/perception/fusion.h"
#include "adaptation/perception/registration.h"
#include "adaptation/regrasp/grasp_planner.h"
#include "adaptation/regrasp/manipulator.h"
#include "adaptation/regrasp/self_filter.h"
#include "adaptation/regrasp/surroundings.h"
#include "adaptation/regrasp/survey.h"
#include "adaptation/wrench/carried_load.h"

namespace walkman::regrasp {
namespace {

constexpr double kAtBorder = 0.03, kInView = 0.09;  // rad from the image's border
constexpr double kFarthestTurn = 1.0;               // rad, for a target that may be anywhere
constexpr std::size_t kMostPlans = 3;
constexpr int kEnoughTries = 2;
constexpr int kMostGivenUp = 2;    // lifts in a row
constexpr double kOtherLoad = 4;   // standard deviations between two weighings that are not of the same load
constexpr double kAnyLength = 10;  // m, more than a hand holds
// How far an object may move in the hand from before it closes to after the lift. A bar is drawn into the
// palm by 2 cm, and the pads let it tilt by 0.11 rad under the most that a hand holds, 3.4 N·m.
constexpr double kMostMoved = 0.04;  // m
constexpr double kMostTurned = 0.2;  // rad
constexpr double kSeenTurn = 0.05;   // rad, error of the registered turn of an object seen from one side only
constexpr double kFarthestSeen = 0.055;  // m, less than kSeenAround
constexpr double kLies = 0.025;          // m from its surface, at most, for a bar drawn into the palm
constexpr float kSeenAround = 0.06F;   // m, within which a point of it may be: closer than the table below it
constexpr double kCloudTimeout = 5.0;  // s without a new cloud: many frame periods of the camera

/// Axial position on a handle nearest to a line, each given by a point and a unit direction, in one frame.
double nearest_along(const Eigen::Vector3d& centre, const Eigen::Vector3d& axis, const Eigen::Vector3d& point,
                     const Eigen::Vector3d& direction) {
  const Eigen::Vector3d across =
      axis - axis.dot(direction) * direction;  // part of the axis perpendicular to the line
  const double square = across.squaredNorm();
  return square < 1e-9 ? 0 : across.dot(point - centre) / square;
}

double largest_eigenvalue(const Eigen::Matrix3d& covariance) {
  return std::max(
      0.0,
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance, Eigen::EigenvaluesOnly).eigenvalues()[2]);
}

/// Standard deviation of d = (x τ_y − y τ_x) / (f (x² + y²)) along the handle's axis (x, y, ·) under a weight
/// f, from the covariance of torque and weight.
double deviation_of_displacement(const Eigen::Matrix4d& covariance, const Eigen::Vector3d& right_T,
                                 const Weighing& weighing) {
  const double level = right_T.head<2>().squaredNorm();
  if (level < 1e-9) return kAnyLength;
  const Eigen::Vector4d slope(-right_T.y() / level, right_T.x() / level, 0, -weighing.displacement);
  return std::sqrt(std::max(0.0, slope.dot(covariance * slope))) / weighing.f_g;
}

/// Point to bring to the centre of the image, in C, so that more of an object cut by the border is seen: the
/// visible end moves to the opposite border.
Eigen::Vector3d to_look_at(const perception::SeenObject& object) {
  const auto turn = [](double before, double after) {
    if (after < kAtBorder && before >= kAtBorder) return std::clamp(before - kInView, 0.0, kFarthestTurn);
    return 0.0;
  };
  const perception::ImageMargins& margins = object.to_border;
  const double right = turn(margins.left, margins.right) - turn(margins.right, margins.left);
  const double down = turn(margins.up, margins.down) - turn(margins.down, margins.up);
  return object.p_CCm.z() * Eigen::Vector3d(std::tan(right), std::tan(down), 1);
}

}  // namespace

struct Regrasp::Impl {
  Impl(const KnownRobot& known_robot, robot::Robot& robot, robot::Cycle& cycle,
       camera::RangeCamera& range_camera, const MethodParameters& all, Observer& watcher, Thinking when)
      : known(known_robot),
        parameters(all),
        thinking(when),
        camera(range_camera),
        observer(watcher),
        session(known_robot, robot, cycle, watcher),
        self_filter(known_robot.model),
        manipulator(known_robot, session, all.stage_two),
        posed(session.measured()) {}

  /// Looks for the object at p_T (m), or for the largest; if it is cut by the image's border, looks again
  /// with the head turned to it.
  void look(const std::optional<Eigen::Vector3d>& p_T);
  void take_cloud();
  /// Looks again at the object in `seen`, from around it, and evaluates all views together.
  void look_around();
  /// Records how the robot stands.
  void stand();
  /// Returns the result of `think`; see Thinking.
  template <typename T>
  [[nodiscard]] T await(const std::function<T()>& think);
  /// Returns the grasp to take, and makes its hand the active one.
  [[nodiscard]] PlannedGrasp plan(const GraspPlanner::Cost& cost, double nearer_than,
                                  const std::vector<GraspPlanner::Blocked>& blocked);
  /// Plans a grasp that costs less than `nearer_than` (m) and takes it; if the way turns out to be blocked,
  /// the hand goes back and takes the next one not beside it, or the other hand does.
  PlannedGrasp reach_and_grasp(const GraspPlanner::Cost& cost, double nearer_than);
  /// Returns the box around the object seen, down to the table, in the frame H of a hand at X_TH.
  [[nodiscard]] Eigen::AlignedBox3d around(const Eigen::Isometry3d& X_TH) const;
  void reach(const PlannedGrasp& grasp);
  /// Returns the object's surface as seen, in H.
  [[nodiscard]] std::vector<Eigen::Vector3f> surface_in(const Eigen::Isometry3d& X_TH) const;
  /// Looks at the object in the hand. Throws HeldTooFar if it is not where it was on the table relative to
  /// the hand; makes no statement about an object of which less than half is in view.
  void require_hold();
  /// Throws HeldTooFar with the object still in the hand. `best_cost`: of the grasp, m, if no better place
  /// has room for a hand.
  [[nodiscard]] Weighing lift_and_weigh(const std::optional<double>& best_cost);
  /// Same for a load that has changed in the hand.
  [[nodiscard]] Weighing weigh_other_load();
  /// Lowers the object and throws RunStopped if the best available place has no less torque than the first.
  void require_gain(const Weighing& first, const Weighing& last, const PlannedGrasp& grasp);
  /// Returns what keeps the hands from a place where the torque would be less by more than d_thres; empty if
  /// nothing does.
  [[nodiscard]] std::string hindrance(const PlannedGrasp& grasp) const;
  /// Watches the object in the hand; returns whether its load has changed.
  bool watch();
  /// Lowers the object again and throws RunStopped with the reason.
  [[noreturn]] void lower_for(const Refused& refusal);
  /// Returns the pose of the hand when it let go, in T.
  Eigen::Isometry3d lower_again();
  /// After a release at X_TH_released: looks at the object that the hand carried with F_Ho_T when it was at
  /// X_TH. Returns the cost of places on it with respect to the line of that weight.
  [[nodiscard]] GraspPlanner::Cost look_again(const Wrench& F_Ho_T, const Eigen::Isometry3d& X_TH,
                                              const Eigen::Isometry3d& X_TH_released);
  /// Returns the cost (m) below which a place is nearer, by the displacement threshold, to the centre of mass
  /// that the hand felt; 0 if no place can be.
  [[nodiscard]] double distance_to_beat(const HeldTooFar& refusal) const;
  [[nodiscard]] Weighing turn_and_hang(bool in_hand, const std::optional<double>& best_cost);
  /// Returns whether something was taken off the object, or put on it, between two weighings.
  [[nodiscard]] static bool is_other_load(const Weighing& before, const Weighing& after) {
    return std::abs(after.f_g - before.f_g) >
           kOtherLoad * std::hypot(before.force_deviation, after.force_deviation);
  }
  /// Returns whether, by a weighing, the hand is no farther from the CoM line than a planned grasp of this
  /// cost was to bring it.
  [[nodiscard]] bool as_planned(const Weighing& weighing, const std::optional<double>& cost) const {
    return cost &&
           std::abs(weighing.torque) / weighing.f_g < *cost + parameters.stage_two.displacement_threshold;
  }
  [[nodiscard]] Weighing weigh();
  /// Returns the distance along the handle from the place where |d_h × f| is least (paper, sec. 3.2), by the
  /// remaining torque. `line_H`: CoM line as carried by the hand at X_TH.
  [[nodiscard]] GraspPlanner::Cost least_torque(const wrench::ComLine& line_H,
                                                const Eigen::Isometry3d& X_TH) const;

  const KnownRobot& known;
  const MethodParameters& parameters;
  Thinking thinking;
  camera::RangeCamera& camera;
  Observer& observer;
  Session session;
  SelfFilter self_filter;
  Manipulator manipulator;
  std::optional<GraspPlanner> planner;  // set once the robot knows how it stands
  camera::OrganizedCloud cloud;         // as the camera sent it
  camera::OrganizedCloud outside;       // the part of it that is not the robot
  perception::StageOneResult seen;
  std::optional<Weighing> last_weighing;
  // The table as first seen, in T: with the head turned, less of it is in the image.
  std::vector<Eigen::Vector3d> table_T;
  std::vector<motion::NamedObstacle> obstacles;  // in T
  std::vector<Eigen::Vector3f> held_H;           // the object's surface before the hand closed
  double held_radius = 0;                        // m, of the handle
  // Posture and camera while the robot stood still for `cloud`.
  motion::KinematicTree posed;
  Eigen::Isometry3d X_TC = Eigen::Isometry3d::Identity();
};

template <typename T>
T Regrasp::Impl::await(const std::function<T()>& think) {
  if (thinking == Thinking::kBetweenCycles) return think();
  auto result = std::async(std::launch::async, think);
  std::exception_ptr stopped;
  while (result.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    try {
      manipulator.hold(session.period());
    } catch (const RunStopped&) {
      // The evaluation cannot be cancelled, and the drives need their cycle meanwhile.
      if (!stopped) stopped = std::current_exception();
    }
  }
  if (stopped) std::rethrow_exception(stopped);
  return result.get();
}

void Regrasp::Impl::stand() {
  posed = session.measured();
  X_TC = session.X_TC();
}

void Regrasp::Impl::take_cloud() {
  Time asked = session.now();
  int recoveries = session.recoveries();
  stand();
  const auto has_come = [&] {
    try {
      return camera.latest(asked, cloud);
    } catch (const camera::Lost& lost) {
      throw RunStopped(lost.what());
    }
  };
  while (!has_come()) {
    if (std::chrono::duration<double>(session.now() - asked).count() > kCloudTimeout) {
      throw RunStopped(fmt::format("no cloud from the camera for {} s", kCloudTimeout));
    }
    manipulator.hold(session.period());
    stand();
    if (session.recoveries() == recoveries) continue;
    // The robot may have moved meanwhile.
    manipulator.settle();
    recoveries = session.recoveries();
    asked = session.now();
  }
}

void Regrasp::Impl::look(const std::optional<Eigen::Vector3d>& p_T) {
  session.enter(Phase::kLook);
  bool asked_for = p_T.has_value();
  Eigen::Vector3d near_T = p_T.value_or(Eigen::Vector3d::Zero());
  for (int looks = 1;; ++looks) {
    take_cloud();
    try {
      seen = await<perception::StageOneResult>([&] {
        outside = cloud;
        self_filter.remove(posed, X_TC, outside);
        if (!asked_for) return perception::locate(outside, parameters.stage_one);
        return perception::locate(outside, parameters.stage_one, X_TC.inverse() * near_T);
      });
    } catch (const perception::NotLocated& e) {
      // The requested object may be beyond the image's border.
      if (asked_for && looks < parameters.stage_two.max_looks && manipulator.look_at(near_T)) continue;
      throw RunStopped(p_T ? fmt::format("the object is not where the hand let go of it: {}", e.what())
                           : e.what());
    }
    if (table_T.empty()) {
      table_T = await<std::vector<Eigen::Vector3d>>([&] { return table_outline(seen, outside, X_TC); });
    }
    if (!seen.object().cut_by_image || looks == parameters.stage_two.max_looks) break;
    if (!manipulator.look_at(X_TC * to_look_at(seen.object()))) break;
    // Looks for the same object, by a point of it that is certain to have been seen.
    const auto& surface_C = seen.object().surface_C;
    const auto nearest =
        std::min_element(surface_C.begin(), surface_C.end(), [&](const auto& a, const auto& b) {
          const Eigen::Vector3f middle_C = seen.object().p_CCm.cast<float>();
          return (a - middle_C).squaredNorm() < (b - middle_C).squaredNorm();
        });
    near_T = X_TC * nearest->cast<double>();
    asked_for = true;
  }
  if (parameters.stage_one.look == Look::kAround) look_around();
  if (!seen.grasp) throw RunStopped("no handle of the hand's size on the object");
  obstacles = await<std::vector<motion::NamedObstacle>>([&] {
    std::vector<Eigen::Vector3d> outline_T = table_outline(seen, outside, X_TC);
    outline_T.insert(outline_T.end(), table_T.begin(), table_T.end());
    return surroundings(seen, outline_T, X_TC);
  });
  manipulator.set_obstacles(obstacles);
  observer.on_located(cloud, seen);
}

void Regrasp::Impl::look_around() {
  Survey survey(manipulator, camera, [this] {
    take_cloud();
    return await<Survey::View>([this] {
      Survey::View view{cloud, X_TC};
      self_filter.remove(posed, X_TC, view.outside);
      return view;
    });
  });
  const camera::OrganizedCloud first = cloud, first_outside = outside;
  const Eigen::Isometry3d X_TC_first = X_TC;
  const motion::KinematicTree posed_first = posed;
  Survey::Found found = survey.around(X_TC_first, seen.object());
  cloud = first;
  outside = first_outside;
  X_TC = X_TC_first;
  posed = posed_first;
  std::size_t left_out = 0;
  seen = await<perception::StageOneResult>([&] {
    self_filter.remove(posed, X_TC, found.sweep);
    Eigen::AlignedBox3f region;
    for (const Eigen::Vector3f& p_C : seen.object().surface_C) region.extend(p_C);
    region.min().array() -= kSeenAround;
    region.max().array() += kSeenAround;
    perception::Fusion fusion(outside.points, region, seen.plane, parameters.stage_one.outlier_voxel);
    const auto add = [&](const camera::OrganizedCloud& view, const Eigen::Isometry3d& X_CV) {
      if (!view.points.empty() && !fusion.add(view.points, X_CV)) ++left_out;
    };
    add(found.sweep, Eigen::Isometry3d::Identity());
    for (const Survey::View& view : found.views) add(view.outside, X_TC.inverse() * view.X_TC);
    const Eigen::Vector3d on_object_C = seen.object().surface_C.front().cast<double>();
    return perception::locate(outside, parameters.stage_one, on_object_C, fusion.points());
  });
  if (left_out > 0)
    observer.on_warning(fmt::format("{} of {} views from around do not lie on the first and are left out",
                                    left_out, found.views.size() + 1),
                        session.now());
}

PlannedGrasp Regrasp::Impl::plan(const GraspPlanner::Cost& cost, double nearer_than,
                                 const std::vector<GraspPlanner::Blocked>& blocked) {
  const motion::HandMotion& motion = manipulator.motion();
  const GraspPlanner::View view{&seen, X_TC, obstacles, motion.q_ref(), motion.q_stood(), blocked};
  PlannedGrasp grasp = await<PlannedGrasp>([&] { return planner->plan(view, cost, nearer_than); });
  manipulator.use(grasp.hand);
  manipulator.set_obstacles(grasp.obstacles);
  return grasp;
}

PlannedGrasp Regrasp::Impl::reach_and_grasp(const GraspPlanner::Cost& cost, double nearer_than) {
  std::vector<GraspPlanner::Blocked> blocked;
  while (true) {
    PlannedGrasp grasp = plan(cost, nearer_than, blocked);
    observer.on_grasp(grasp.X_TG);
    try {
      reach(grasp);
    } catch (const WayBlocked& way) {
      blocked.push_back({grasp.hand, grasp.X_TG.translation(), way.what()});
      if (blocked.size() == kMostPlans) throw;
      observer.on_warning(fmt::format("{}; the next grasp is tried", way.what()), session.now());
      session.enter(Phase::kRetreat);
      manipulator.retreat();
      continue;
    }
    held_H = surface_in(session.X_TH());
    held_radius = grasp.radius;
    manipulator.grasp(grasp.radius, around(grasp.X_TH));
    return grasp;
  }
}

Eigen::AlignedBox3d Regrasp::Impl::around(const Eigen::Isometry3d& X_TH) const {
  const Eigen::Isometry3d X_HC = X_TH.inverse() * X_TC;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& p_C : seen.object().surface_C) {
    const Eigen::Vector3d p = p_C.cast<double>();
    const double height = seen.plane.n_C.dot(p) + seen.plane.offset;
    box.extend(X_HC * p);
    box.extend(X_HC * (p - height * seen.plane.n_C));
  }
  if (seen.object().cut_by_image) {  // it continues along the handle
    box.min().x() = -kAnyLength;
    box.max().x() = kAnyLength;
  }
  return box;
}

std::vector<Eigen::Vector3f> Regrasp::Impl::surface_in(const Eigen::Isometry3d& X_TH) const {
  const Eigen::Isometry3f X_HC = (X_TH.inverse() * X_TC).cast<float>();
  std::vector<Eigen::Vector3f> points;
  points.reserve(seen.object().surface_C.size());
  for (const Eigen::Vector3f& p_C : seen.object().surface_C) points.push_back(X_HC * p_C);
  return points;
}

void Regrasp::Impl::require_hold() {
  const Eigen::Isometry3d X_TC_seen = X_TC;
  take_cloud();
  const Eigen::Isometry3d X_TH = session.X_TH();
  double lever = 0;  // m, mean position of the compared points along the handle
  const auto moved = await<std::optional<Eigen::Isometry3d>>([&] {
    outside = cloud;
    self_filter.remove(posed, X_TC, outside);
    const Eigen::Isometry3f X_HC = (X_TH.inverse() * X_TC).cast<float>();
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector3f& p_H : held_H) box.extend(p_H);
    box.min().array() -= kSeenAround;
    box.max().array() += kSeenAround;
    std::vector<Eigen::Vector3f> now_H;
    std::copy_if(outside.points.begin(), outside.points.end(), std::back_inserter(now_H),
                 [&](const Eigen::Vector3f& p_C) { return p_C.allFinite() && box.contains(X_HC * p_C); });
    Eigen::AlignedBox3f in_view;
    for (Eigen::Vector3f& p : now_H) in_view.extend(p = X_HC * p);
    // A part that the image's border cuts off now would draw the rest of the object to where the image ends.
    std::vector<Eigen::Vector3f> before_H;
    std::copy_if(held_H.begin(), held_H.end(), std::back_inserter(before_H), [&](const Eigen::Vector3f& p_H) {
      return p_H.x() > in_view.min().x() + kSeenAround && p_H.x() < in_view.max().x() - kSeenAround;
    });
    for (const Eigen::Vector3f& p_H : before_H) lever += static_cast<double>(p_H.x());
    if (!before_H.empty()) lever /= static_cast<double>(before_H.size());
    return perception::motion_of(before_H, now_H, kSeenAround, kLies);
  });
  X_TC = X_TC_seen;  // that of `seen`
  if (!moved) return;
  // Motion of the handle's axis, about which the object may have turned in the fingers, and a bar's surface
  // does not show such a turn. Only across the axis: along it, where the image's border has cut the object,
  // the cut looks like its end.
  const Eigen::Vector3d p_HAxis = handle_axis(held_radius, parameters.stage_two);
  const double distance = (*moved * p_HAxis - p_HAxis).tail<2>().norm();
  const double angle = std::acos(std::clamp(moved->linear()(0, 0), -1.0, 1.0));  // of the handle
  const double farthest = std::min(kMostMoved + kSeenTurn * std::abs(lever), kFarthestSeen);
  const double most_turned = kMostTurned + kSeenTurn;
  if (distance <= farthest && angle <= most_turned) return;
  throw HeldTooFar(
      fmt::format(
          "the camera sees the object moved by {:.0f} mm and turned by {:.2f} rad in the hand, expected at "
          "most {:.0f} mm and {:.2f} rad: it slips",
          1e3 * distance, angle, 1e3 * farthest, most_turned),
      manipulator.carried());
}

/// The sensor's residual is removed just before; anything rebooted since then may have another one.
void Regrasp::Impl::reach(const PlannedGrasp& grasp) {
  while (true) {
    session.enter(Phase::kApproach);
    manipulator.approach(grasp.way);
    session.enter(Phase::kTare);
    const int recoveries = session.recoveries();
    manipulator.tare();
    session.enter(Phase::kGrasp);
    manipulator.descend(grasp.X_TH);
    if (session.recoveries() == recoveries) return;
    manipulator.ascend();
  }
}

void Regrasp::Impl::lower_for(const Refused& refusal) {
  observer.on_warning(fmt::format("{}; the object is being lowered", refusal.what()), session.now());
  try {
    lower_again();
  } catch (const RunStopped& stopped) {
    throw RunStopped(fmt::format("{}; while the object was lowered: {}", refusal.what(), stopped.what()));
  }
  throw RunStopped(fmt::format("{}; the object was lowered", refusal.what()));
}

bool Regrasp::Impl::watch() {
  try {
    session.enter(Phase::kWatch);
    return manipulator.watch();
  } catch (const Refused& refusal) {
    lower_for(refusal);
  }
}

Weighing Regrasp::Impl::lift_and_weigh(const std::optional<double>& best_cost) {
  try {
    session.enter(Phase::kLift);
    manipulator.lift();
    require_hold();
    return turn_and_hang(false, best_cost);
  } catch (const HeldTooFar&) {
    throw;
  } catch (const Refused& refusal) {
    lower_for(refusal);
  }
}

Weighing Regrasp::Impl::weigh_other_load() {
  try {
    manipulator.take_up();
    // The object seats itself anew in the fingers while the hand turns, under a load that has changed: it is
    // weighed in the next turn.
    session.enter(Phase::kTurn);
    manipulator.turn();
    manipulator.take_up();
    return turn_and_hang(true, std::nullopt);
  } catch (const Refused& refusal) {
    lower_for(refusal);
  }
}

double Regrasp::Impl::distance_to_beat(const HeldTooFar& refusal) const {
  const double what_counts = parameters.stage_two.displacement_threshold;
  const auto line = wrench::com_line(refusal.F_Ho_T, parameters.stage_two.min_force);
  if (!line) return 0;
  const Eigen::Vector3d right_T = session.X_TH().linear().col(0);
  const double along = std::abs(nearest_along(Eigen::Vector3d::Zero(), right_T, line->p_PF, line->direction));
  if (along <= what_counts) return 0;
  const double across = std::sqrt(std::max(0.0, line->p_PF.squaredNorm() - along * along));
  return std::hypot(across, along - what_counts);
}

Eigen::Isometry3d Regrasp::Impl::lower_again() {
  session.enter(Phase::kLower);
  return manipulator.lower_and_release();
}

GraspPlanner::Cost Regrasp::Impl::look_again(const Wrench& F_Ho_T, const Eigen::Isometry3d& X_TH,
                                             const Eigen::Isometry3d& X_TH_released) {
  manipulator.check_residual();
  session.enter(Phase::kRetreat);
  manipulator.retreat();
  look(X_TH_released.translation());
  const auto line = wrench::com_line(F_Ho_T, parameters.stage_two.min_force);
  const Eigen::Matrix3d R_HT = X_TH.linear().transpose();
  return least_torque({R_HT * line->p_PF, R_HT * line->direction}, X_TH_released);
}

Weighing Regrasp::Impl::turn_and_hang(bool in_hand, const std::optional<double>& best_cost) {
  session.enter(Phase::kTurn);
  manipulator.turn();
  Weighing weighing = weigh();
  // No place along the handle is much better; what remains across it vanishes when the object hangs straight.
  if ((std::abs(weighing.displacement) <= parameters.stage_two.displacement_threshold ||
       as_planned(weighing, best_cost)) &&
      std::abs(weighing.torque) > parameters.stage_two.torque_threshold) {
    session.enter(Phase::kTurn);
    manipulator.hang();
    weighing = weigh();
  }
  weighing.in_hand = in_hand;
  weighing.changed = in_hand || (last_weighing && is_other_load(*last_weighing, weighing));
  last_weighing = weighing;
  observer.on_weighed(weighing);
  return weighing;
}

Weighing Regrasp::Impl::weigh() {
  session.enter(Phase::kWeigh);
  Weighing weighing;
  const WristScale::Load load = manipulator.weigh();
  weighing.F_Ho_T = load.F_Ho_T;
  weighing.force_deviation = std::sqrt(std::max(0.0, load.covariance(3, 3)));
  weighing.torque_deviation = std::sqrt(largest_eigenvalue(load.covariance.topLeftCorner<3, 3>()));
  weighing.X_TH = session.X_TH();
  weighing.p_HCm = load.p_HCm;
  weighing.f_g = -weighing.F_Ho_T.force.z();
  const auto line = wrench::com_line(weighing.F_Ho_T, parameters.stage_two.min_force);
  if (!line) throw Refused("the object slipped out of the hand while it was weighed");
  manipulator.scale().require_of_object(weighing.F_Ho_T, weighing.torque_deviation);
  const Eigen::Vector3d right_T = weighing.X_TH.linear().col(0);
  weighing.displacement = nearest_along(Eigen::Vector3d::Zero(), right_T, line->p_PF, line->direction);
  weighing.displacement_deviation = deviation_of_displacement(load.covariance, right_T, weighing);
  weighing.torque = std::copysign(weighing.F_Ho_T.torque.norm(), weighing.displacement);
  weighing.torque_about_handle = right_T.dot(weighing.F_Ho_T.torque);
  return weighing;
}

GraspPlanner::Cost Regrasp::Impl::least_torque(const wrench::ComLine& line_H,
                                               const Eigen::Isometry3d& X_TH) const {
  const Eigen::Vector3d point = X_TH * line_H.p_PF;
  const Eigen::Vector3d direction = X_TH.linear() * line_H.direction;
  return [this, point, direction](const perception::Handle& handle, double along) {
    // About where the palm lies on the handle: on an inclined handle, that is not level with its axis.
    const Eigen::Vector3d n_C = seen.plane.n_C - seen.plane.n_C.dot(handle.axis_C) * handle.axis_C;
    const Eigen::Vector3d palm_C = handle.p_CM + along * handle.axis_C + handle.radius * n_C.normalized();
    return wrench::torque_about({point, direction}, 1, Eigen::Vector3d(X_TC * palm_C));
  };
}

std::string Regrasp::Impl::hindrance(const PlannedGrasp& grasp) const {
  if (grasp.cost <= grasp.least_cost + parameters.stage_two.displacement_threshold) return "";
  return fmt::format(
      "no hand can grasp within {:.0f} mm of the centre of mass; at {:.0f} mm, straight down, {}",
      1e3 * grasp.cost, 1e3 * grasp.least_cost, grasp.refusal);
}

void Regrasp::Impl::require_gain(const Weighing& first, const Weighing& last, const PlannedGrasp& grasp) {
  const StageTwoParameters& limits = parameters.stage_two;
  const std::string why = hindrance(grasp);
  if (why.empty() || std::abs(last.displacement) <= limits.displacement_threshold ||
      std::abs(last.torque) < std::abs(first.torque) - limits.torque_threshold)
    return;
  lower_again();
  throw RunStopped(why + "; the torque there is no less than at first, so the object was lowered");
}

Regrasp::Regrasp(const KnownRobot& known, robot::Robot& robot, robot::Cycle& cycle,
                 camera::RangeCamera& camera, const MethodParameters& parameters, Observer& observer,
                 Thinking thinking)
    : impl_(std::make_unique<Impl>(known, robot, cycle, camera, parameters, observer, thinking)) {}

Regrasp::~Regrasp() = default;

Report Regrasp::run() {
  Impl& r = *impl_;
  const StageTwoParameters& limits = r.parameters.stage_two;
  r.session.boot();
  r.session.enter(Phase::kSettle);
  r.manipulator.start();
  r.session.enter(Phase::kCalibrate);
  r.manipulator.calibrate();
  r.planner.emplace(r.known, r.session.joint_names(), r.session.stance(), r.parameters);
  r.look(std::nullopt);
  GraspPlanner::Cost cost = [&r](const perception::Handle& handle, double along) {
    return (handle.p_CM + along * handle.axis_C - r.seen.object().p_CCm).norm();
  };
  Report report;
  std::vector<Weighing> same;  // the weighings of the present load
  Eigen::Isometry3d X_TH_released = Eigen::Isometry3d::Identity();
  bool nearest = false;  // the grasp is the nearest to the CoM line that the handles allow
  int no_nearer = 0;     // number of grasps no nearer than the one before
  int given_up = 0;      // lifts given up in a row
  double nearer_than = std::numeric_limits<double>::infinity();
  std::string why;  // reason of the last of them
  // A later failure must not hide why a lift was given up.
  const auto with_reason = [&](const RunStopped& stopped) {
    return RunStopped(fmt::format("{}; then: {}", why, stopped.what()));
  };
  while (true) {
    PlannedGrasp grasp;
    Weighing weighing;
    std::optional<double> best_cost;
    try {
      grasp = r.reach_and_grasp(cost, nearer_than);
    } catch (const RunStopped& stopped) {
      if (why.empty()) throw;
      throw with_reason(stopped);
    }
    if (!same.empty() && grasp.unreached_cost > grasp.cost - limits.displacement_threshold)
      best_cost = grasp.cost;
    try {
      weighing = r.lift_and_weigh(best_cost);
    } catch (const HeldTooFar& refusal) {
      nearer_than = r.distance_to_beat(refusal);
      if (nearer_than <= 0 || ++given_up > kMostGivenUp) r.lower_for(refusal);
      const Eigen::Isometry3d X_TH = r.session.X_TH();
      try {
        r.manipulator.scale().require_of_object(refusal.F_Ho_T);
      } catch (const Refused&) {
        r.lower_for(refusal);  // the sensor's readings are of no use
      }
      why = fmt::format("{}; the object was lowered", refusal.what());
      X_TH_released = r.lower_again();
      r.manipulator.forget_load();
      r.observer.on_warning(why + ", to be grasped nearer to its centre of mass", r.session.now());
      try {
        cost = r.look_again(refusal.F_Ho_T, X_TH, X_TH_released);
      } catch (const RunStopped& stopped) {
        throw with_reason(stopped);
      }
      continue;
    }
    given_up = 0;
    nearer_than = std::numeric_limits<double>::infinity();
    why.clear();
    if (weighing.changed) {  // the grasp was chosen for another load
      same.clear();
      best_cost.reset();
      no_nearer = 0;
    }
    nearest = false;
    if (!same.empty()) {
      // No possible grasp is nearer by more than the displacement threshold; from where the hand comes next
      // time there may be one.
      const double last = std::abs(report.weighings.back().displacement);
      if (grasp.cost > last - limits.displacement_threshold) ++no_nearer;
      nearest =
          no_nearer >= kEnoughTries ||
          (grasp.X_TG.translation() - X_TH_released.translation()).norm() <= limits.displacement_threshold;
    }
    nearest = nearest || r.as_planned(weighing, best_cost);
    if (nearest && !same.empty()) r.require_gain(same.front(), weighing, grasp);
    while (true) {
      report.weighings.push_back(weighing);
      same.push_back(weighing);
      const auto ending = ending_after(same, nearest, limits);
      if (!ending) break;
      if (!r.watch()) {
        report.ending = *ending;
        if (same.size() > 1) report.hindrance = r.hindrance(grasp);
        return report;
      }
      weighing = r.weigh_other_load();
      same.clear();
      nearest = false;
      no_nearer = 0;
    }
    X_TH_released = r.lower_again();
    cost = r.look_again(weighing.F_Ho_T, weighing.X_TH, X_TH_released);
  }
}

}  // namespace walkman::regrasp
