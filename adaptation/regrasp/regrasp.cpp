#include "adaptation/regrasp/regrasp.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <future>
#include <limits>

#include <fmt/format.h>

#include "adaptation/regrasp/grasp_planner.h"
#include "adaptation/regrasp/manipulator.h"
#include "adaptation/wrench/carried_load.h"

namespace walkman::regrasp {
namespace {

constexpr int kMostLooks = 3;
constexpr int kEnoughTries = 2;
constexpr double kMostLeft = 0.05;     // of the first displacement; the paper's regrasps leave less (table 1)
constexpr double kUnseenEdge = 0.01;   // m by which a table may reach beyond its points
constexpr double kUnseenSide = 0.4;    // m by which it may reach beyond the image: as far as an elbow swings
constexpr double kImageSide = 0.03;    // of its width
constexpr double kCloudTimeout = 5.0;  // s without a new cloud: many frame periods of the camera

/// The CoM line as the hand carries it: relative to Ho, in H.
struct CarriedLine {
  wrench::ComLine line_H;
  double force;  // N
};

/// Axial position on a handle nearest to a line: both as point and unit direction, in one frame.
double nearest_along(const Eigen::Vector3d& centre, const Eigen::Vector3d& axis, const Eigen::Vector3d& point,
                     const Eigen::Vector3d& direction) {
  const Eigen::Vector3d across =
      axis - axis.dot(direction) * direction;  // part of the axis square to the line
  const double square = across.squaredNorm();
  return square < 1e-9 ? 0 : across.dot(point - centre) / square;
}

/// Whether a regrasp that came near left more of the first torque than regrasps do when they meet their
/// place.
bool worth_another(const std::vector<Weighing>& weighings, double torque_threshold) {
  const Weighing &first = weighings.front(), &last = weighings.back();
  return weighings.size() > 1 && std::abs(last.displacement) * last.f_g > torque_threshold &&
         std::abs(last.displacement) > kMostLeft * std::abs(first.displacement);
}

/// The hull of the points seen of a table, as far as the table may reach: its edges a little, and beyond the
/// sides of the image.
std::vector<Eigen::Vector3d> whole_table(const std::vector<Eigen::Vector3d>& hull_C,
                                         const camera::OrganizedCloud& cloud) {
  double left = std::numeric_limits<double>::infinity(), right = -left;
  for (const Eigen::Vector3f& p : cloud.points) {
    if (!std::isfinite(p.x())) continue;
    const double direction = static_cast<double>(p.x()) / static_cast<double>(p.z());
    left = std::min(left, direction);
    right = std::max(right, direction);
  }
  const double side = kImageSide * (right - left);
  Eigen::Vector3d middle_C = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : hull_C) middle_C += p / static_cast<double>(hull_C.size());
  std::vector<Eigen::Vector3d> out;
  out.reserve(hull_C.size());
  for (const Eigen::Vector3d& p : hull_C) {
    Eigen::Vector3d far = p + kUnseenEdge * (p - middle_C).normalized();
    if (p.x() / p.z() < left + side) far.x() -= kUnseenSide;
    if (p.x() / p.z() > right - side) far.x() += kUnseenSide;
    out.push_back(far);
  }
  return out;
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
        manipulator(known_robot, session, all.stage_two) {}

  /// Looks for the object at p_T (m), or for the largest; where it has no handle and is cut by the image's
  /// border, again with the head turned to it.
  void look(const std::optional<Eigen::Vector3d>& p_T);
  void take_cloud();
  /// What `think` returns; see Thinking.
  template <typename T>
  [[nodiscard]] T await(const std::function<T()>& think);
  [[nodiscard]] std::vector<motion::NamedObstacle> obstacles() const;
  /// The grasp to go for, with the hand in use that takes it.
  [[nodiscard]] PlannedGrasp plan(const GraspPlanner::Cost& cost);
  void reach_and_grasp(const PlannedGrasp& grasp);
  /// Lowers the object again and throws RunStopped where it is refused.
  [[nodiscard]] Weighing lift_and_weigh();
  [[nodiscard]] Weighing lift_and_hang();
  [[nodiscard]] Weighing weigh();
  /// Distance along the handle from where |d_h × f| is least (paper, sec. 3.2), by the torque left.
  [[nodiscard]] GraspPlanner::Cost least_torque(const CarriedLine& carried,
                                                const Eigen::Isometry3d& X_TH) const;

  const KnownRobot& known;
  const MethodParameters& parameters;
  Thinking thinking;
  camera::RangeCamera& camera;
  Observer& observer;
  Session session;
  Manipulator manipulator;
  std::optional<GraspPlanner> planner;  // since the robot knows how it stands
  camera::OrganizedCloud cloud;
  perception::StageOneResult seen;
  Eigen::Isometry3d X_TC = Eigen::Isometry3d::Identity();  // camera while the robot stood still for `cloud`
};

template <typename T>
T Regrasp::Impl::await(const std::function<T()>& think) {
  if (thinking == Thinking::kBetweenCycles) return think();
  auto result = std::async(std::launch::async, think);
  while (result.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    manipulator.hold(session.period());
  }
  return result.get();
}

void Regrasp::Impl::take_cloud() {
  Time asked = session.now();
  int recoveries = session.recoveries();
  X_TC = session.X_TC();
  while (!camera.latest(asked, cloud)) {
    if (std::chrono::duration<double>(session.now() - asked).count() > kCloudTimeout) {
      throw RunStopped(fmt::format("no cloud from the camera for {} s", kCloudTimeout));
    }
    manipulator.hold(session.period());
    X_TC = session.X_TC();
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
        if (!asked_for) return perception::locate(cloud, parameters.stage_one);
        return perception::locate(cloud, parameters.stage_one, X_TC.inverse() * near_T);
      });
    } catch (const perception::NotLocated& e) {
      // What is asked for may be beyond the image's border.
      if (asked_for && looks < kMostLooks && manipulator.look_at(near_T)) continue;
      throw RunStopped(e.what());
    }
    if (seen.grasp || !seen.object().cut_by_image || looks == kMostLooks) break;
    const Eigen::Vector3d middle_T = X_TC * seen.object().p_CCm;
    if (!manipulator.look_at(middle_T)) break;
    // The same object, by a point of it that is seen for certain.
    const auto& surface_C = seen.object().surface_C;
    const auto nearest =
        std::min_element(surface_C.begin(), surface_C.end(), [&](const auto& a, const auto& b) {
          const Eigen::Vector3f middle_C = seen.object().p_CCm.cast<float>();
          return (a - middle_C).squaredNorm() < (b - middle_C).squaredNorm();
        });
    near_T = X_TC * nearest->cast<double>();
    asked_for = true;
  }
  if (!seen.grasp) throw RunStopped("no handle of the hand's size on the object");
  manipulator.set_obstacles(obstacles());
  observer.on_located(cloud, seen);
}

PlannedGrasp Regrasp::Impl::plan(const GraspPlanner::Cost& cost) {
  const GraspPlanner::View view{&seen, X_TC, obstacles(), manipulator.motion().q_ref()};
  PlannedGrasp grasp = await<PlannedGrasp>([&] { return planner->plan(view, cost); });
  manipulator.use(grasp.hand);
  return grasp;
}

/// The table, and what else lies on it.
std::vector<motion::NamedObstacle> Regrasp::Impl::obstacles() const {
  const Eigen::Vector3d up_T = X_TC.linear() * seen.plane.n_C;
  std::vector<Eigen::Vector3d> hull_T;
  for (const Eigen::Vector3d& p : whole_table(seen.plane.hull_C, cloud)) hull_T.push_back(X_TC * p);
  std::vector<motion::NamedObstacle> out = {{"the table", motion::ConvexPrism(up_T, hull_T)}};
  for (std::size_t i = 0; i < seen.objects.size(); ++i) {
    if (i == seen.chosen) continue;
    std::vector<Eigen::Vector3d> top_T;
    double highest = -std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3f& p : seen.objects[i].surface_C) {
      top_T.push_back(X_TC * p.cast<double>());
      highest = std::max(highest, up_T.dot(top_T.back()));
    }
    for (Eigen::Vector3d& p : top_T) p += (highest - up_T.dot(p)) * up_T;
    try {
      out.push_back(
          {fmt::format("the object beside it, {:.0f} cm high", 100 * (highest - up_T.dot(hull_T.front()))),
           motion::ConvexPrism(up_T, top_T)});
    } catch (const std::runtime_error&) {  // seen edge on: too narrow to be in the way
    }
  }
  return out;
}

/// The sensor's residual is removed just before; whatever booted anew since then may have another.
void Regrasp::Impl::reach_and_grasp(const PlannedGrasp& grasp) {
  while (true) {
    session.enter(Phase::kApproach);
    manipulator.approach(grasp.way);
    session.enter(Phase::kTare);
    const int recoveries = session.recoveries();
    manipulator.tare();
    session.enter(Phase::kGrasp);
    manipulator.descend(grasp.X_TH);
    if (session.recoveries() == recoveries) break;
    manipulator.ascend();
  }
  manipulator.grasp(grasp.radius);
}

Weighing Regrasp::Impl::lift_and_weigh() {
  try {
    return lift_and_hang();
  } catch (const Refused& refusal) {
    session.enter(Phase::kLower);
    static_cast<void>(manipulator.lower_and_release());
    throw RunStopped(fmt::format("{}; the object was lowered", refusal.what()));
  }
}

Weighing Regrasp::Impl::lift_and_hang() {
  session.enter(Phase::kLift);
  manipulator.lift();
  session.enter(Phase::kTurn);
  manipulator.turn();
  Weighing weighing = weigh();
  // No place along the handle is better by much; what is left across it goes when the object hangs straight.
  if (std::abs(weighing.displacement) <= parameters.stage_two.displacement_threshold &&
      std::abs(weighing.torque) > parameters.stage_two.torque_threshold) {
    session.enter(Phase::kTurn);
    manipulator.hang();
    weighing = weigh();
  }
  observer.on_weighed(weighing);
  return weighing;
}

Weighing Regrasp::Impl::weigh() {
  session.enter(Phase::kWeigh);
  Weighing weighing;
  weighing.F_Ho_T = manipulator.weigh();
  weighing.X_TH = session.X_TH();
  weighing.f_g = -weighing.F_Ho_T.force.z();
  const auto line = wrench::com_line(weighing.F_Ho_T, parameters.stage_two.min_force);
  if (!line) throw Refused("the object slipped out of the hand while it was weighed");
  const Eigen::Vector3d right_T = weighing.X_TH.linear().col(0);
  weighing.displacement = nearest_along(Eigen::Vector3d::Zero(), right_T, line->p_PF, line->direction);
  weighing.torque = std::copysign(weighing.F_Ho_T.torque.norm(), weighing.displacement);
  weighing.torque_about_handle = right_T.dot(weighing.F_Ho_T.torque);
  return weighing;
}

GraspPlanner::Cost Regrasp::Impl::least_torque(const CarriedLine& carried,
                                               const Eigen::Isometry3d& X_TH) const {
  const Eigen::Vector3d point = X_TH * carried.line_H.p_PF;
  const Eigen::Vector3d direction = X_TH.linear() * carried.line_H.direction;
  return [this, point, direction](const perception::Handle& handle, double along) {
    // About where the palm lies on the handle: of one that leans, that is not level with its axis.
    const Eigen::Vector3d n_C = seen.plane.n_C - seen.plane.n_C.dot(handle.axis_C) * handle.axis_C;
    const Eigen::Vector3d palm_C = handle.p_CM + along * handle.axis_C + handle.radius * n_C.normalized();
    return wrench::torque_about({point, direction}, 1, Eigen::Vector3d(X_TC * palm_C));
  };
}

Regrasp::Regrasp(const KnownRobot& known, robot::Robot& robot, robot::Cycle& cycle,
                 camera::RangeCamera& camera, const MethodParameters& parameters, Observer& observer,
                 Thinking thinking)
    : impl_(std::make_unique<Impl>(known, robot, cycle, camera, parameters, observer, thinking)) {}

Regrasp::~Regrasp() = default;

std::string_view to_string(Ending ending) {
  switch (ending) {
    case Ending::kMinimumTorque:
      return "minimum torque";
    case Ending::kMinimumDisplacement:
      return "minimum displacement";
    case Ending::kRegraspLimit:
      return "regrasp limit";
  }
  return "unknown";
}

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
  PlannedGrasp grasp = r.plan([&r](const perception::Handle& handle, double along) {
    return (handle.p_CM + along * handle.axis_C - r.seen.object().p_CCm).norm();
  });
  Report report;
  bool nearest = false;  // the grasp is the nearest to the CoM line that the handles allow
  int no_nearer = 0;     // how often it was not nearer than the one before
  while (true) {
    r.observer.on_grasp(grasp.X_TG);
    r.reach_and_grasp(grasp);
    const Weighing weighing = r.lift_and_weigh();
    report.weighings.push_back(weighing);
    if (std::abs(weighing.torque) <= limits.torque_threshold) {
      report.ending = Ending::kMinimumTorque;
      return report;
    }
    if (nearest || (std::abs(weighing.displacement) <= limits.displacement_threshold &&
                    !worth_another(report.weighings, limits.torque_threshold))) {
      report.ending = Ending::kMinimumDisplacement;
      return report;
    }
    if (static_cast<int>(report.weighings.size()) > limits.max_regrasps) {
      report.ending = Ending::kRegraspLimit;
      return report;
    }
    const auto line = wrench::com_line(weighing.F_Ho_T, limits.min_force);
    const Eigen::Matrix3d R_HT = weighing.X_TH.linear().transpose();
    const CarriedLine carried{{R_HT * line->p_PF, R_HT * line->direction}, weighing.F_Ho_T.force.norm()};

    r.session.enter(Phase::kLower);
    const Eigen::Isometry3d X_TH_released = r.manipulator.lower_and_release();
    r.session.enter(Phase::kRetreat);
    r.manipulator.retreat();
    r.look(X_TH_released.translation());
    grasp = r.plan(r.least_torque(carried, X_TH_released));
    // Nothing that can be grasped is nearer by more than what counts; from where the hand comes next time
    // there may be.
    if (grasp.cost > std::abs(weighing.displacement) - limits.displacement_threshold) ++no_nearer;
    nearest = no_nearer >= kEnoughTries || (grasp.X_TG.translation() - X_TH_released.translation()).norm() <=
                                               limits.displacement_threshold;
  }
}

}  // namespace walkman::regrasp
