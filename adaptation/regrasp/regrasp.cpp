#include "adaptation/regrasp/regrasp.h"

#include <chrono>
#include <cmath>
#include <future>
#include <limits>

#include <fmt/format.h>

#include "adaptation/regrasp/manipulator.h"
#include "adaptation/wrench/carried_load.h"

namespace walkman::regrasp {
namespace {

constexpr double kCloudTimeout = 5.0;  // s without a new cloud: many frame periods of the camera

/// The CoM line as the hand carries it: relative to Ho, in H.
struct CarriedLine {
  wrench::ComLine line_H;
  double force;  // N
};

/// Least-torque place on a handle (paper, sec. 3.2): where |d_h × f| is least.
struct Candidate {
  int handle = -1;
  double along = 0;
  double torque = std::numeric_limits<double>::infinity();
};

/// Axial position on a handle nearest to a line: both as point and unit direction, in one frame.
double nearest_along(const Eigen::Vector3d& centre, const Eigen::Vector3d& axis, const Eigen::Vector3d& point,
                     const Eigen::Vector3d& direction) {
  const Eigen::Vector3d across =
      axis - axis.dot(direction) * direction;  // part of the axis square to the line
  const double square = across.squaredNorm();
  return square < 1e-9 ? 0 : across.dot(point - centre) / square;
}

}  // namespace

struct Regrasp::Impl {
  Impl(const KnownRobot& known, robot::Robot& robot, robot::Cycle& cycle, camera::RangeCamera& range_camera,
       const MethodParameters& all, Observer& watcher, Thinking when)
      : parameters(all),
        thinking(when),
        camera(range_camera),
        observer(watcher),
        session(known, robot, cycle, watcher),
        manipulator(known.model, session, all.stage_two) {}

  void look();
  [[nodiscard]] perception::StageOneResult evaluate();
  [[nodiscard]] Eigen::Isometry3d frame_on(const perception::GraspFrame& grasp) const;
  void reach_and_grasp(const Eigen::Isometry3d& X_TG);
  [[nodiscard]] Weighing lift_and_weigh();
  [[nodiscard]] Weighing weigh();
  [[nodiscard]] Candidate least_torque(const CarriedLine& carried, const Eigen::Isometry3d& X_TH) const;

  const MethodParameters& parameters;
  Thinking thinking;
  camera::RangeCamera& camera;
  Observer& observer;
  Session session;
  Manipulator manipulator;
  camera::OrganizedCloud cloud;
  perception::StageOneResult seen;
  Eigen::Isometry3d X_TC = Eigen::Isometry3d::Identity();  // camera while the robot stood still for `cloud`
};

perception::StageOneResult Regrasp::Impl::evaluate() {
  if (thinking == Thinking::kBetweenCycles) return perception::locate(cloud, parameters.stage_one);
  auto result =
      std::async(std::launch::async, [this] { return perception::locate(cloud, parameters.stage_one); });
  while (result.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    manipulator.hold(session.period());
  }
  return result.get();
}

void Regrasp::Impl::look() {
  session.enter(Phase::kLook);
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
  try {
    seen = evaluate();
  } catch (const perception::NotLocated& e) {
    throw RunStopped(e.what());
  }
  if (!seen.grasp) throw RunStopped("no handle of the hand's size on the object");
  std::vector<Eigen::Vector3d> hull_T;
  for (const Eigen::Vector3d& p : seen.plane.hull_C) hull_T.push_back(X_TC * p);
  manipulator.set_table(X_TC.linear() * seen.plane.n_C, hull_T);
  observer.on_located(cloud, seen);
}

Eigen::Isometry3d Regrasp::Impl::frame_on(const perception::GraspFrame& grasp) const {
  return X_TC * grasp.X_CG;
}

/// The sensor's residual is removed just before; whatever booted anew since then may have another.
void Regrasp::Impl::reach_and_grasp(const Eigen::Isometry3d& X_TG) {
  while (true) {
    session.enter(Phase::kApproach);
    manipulator.approach(X_TG);
    session.enter(Phase::kTare);
    const int recoveries = session.recoveries();
    manipulator.tare();
    session.enter(Phase::kGrasp);
    manipulator.descend(X_TG);
    if (session.recoveries() == recoveries) break;
    manipulator.ascend();
  }
  manipulator.grasp();
}

Weighing Regrasp::Impl::lift_and_weigh() {
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
  if (!line) throw RunStopped("the object slipped out of the hand while it was weighed");
  const Eigen::Vector3d right_T = weighing.X_TH.linear().col(0);
  weighing.displacement = nearest_along(Eigen::Vector3d::Zero(), right_T, line->p_PF, line->direction);
  weighing.torque = std::copysign(weighing.F_Ho_T.torque.norm(), weighing.displacement);
  return weighing;
}

Candidate Regrasp::Impl::least_torque(const CarriedLine& carried, const Eigen::Isometry3d& X_TH) const {
  const Eigen::Vector3d point = X_TH * carried.line_H.p_PF;
  const Eigen::Vector3d direction = X_TH.linear() * carried.line_H.direction;
  Candidate best;
  const std::vector<perception::Handle>& handles = seen.object().handles;
  for (std::size_t i = 0; i < handles.size(); ++i) {
    const perception::Handle& handle = handles[i];
    const Eigen::Vector3d centre = X_TC * handle.p_CM;
    const Eigen::Vector3d axis = X_TC.linear() * handle.axis_C;
    const double along = handle.nearest_graspable(nearest_along(centre, axis, point, direction));
    const double torque =
        wrench::torque_about({point, direction}, carried.force, Eigen::Vector3d(centre + along * axis));
    if (torque < best.torque) best = {static_cast<int>(i), along, torque};
  }
  return best;
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
  r.look();
  Eigen::Isometry3d X_TG = r.frame_on(*r.seen.grasp);
  Report report;
  bool nearest = false;  // the grasp is the nearest to the CoM line that the handles allow
  while (true) {
    r.observer.on_grasp(X_TG);
    r.reach_and_grasp(X_TG);
    const Weighing weighing = r.lift_and_weigh();
    report.weighings.push_back(weighing);
    if (std::abs(weighing.torque) <= limits.torque_threshold) {
      report.ending = Ending::kMinimumTorque;
      return report;
    }
    if (nearest || std::abs(weighing.displacement) <= limits.displacement_threshold) {
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
    r.look();
    const Candidate next = r.least_torque(carried, X_TH_released);
    X_TG = r.frame_on(perception::grasp_frame_at(r.seen, next.handle, next.along));
    nearest = (X_TG.translation() - X_TH_released.translation()).norm() <= limits.displacement_threshold;
  }
}

}  // namespace walkman::regrasp
