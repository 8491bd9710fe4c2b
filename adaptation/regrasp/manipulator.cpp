#include "adaptation/regrasp/manipulator.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "adaptation/motion/rest_watch.h"
#include "adaptation/wrench/carried_load.h"

namespace walkman::regrasp {
namespace {

constexpr double kMostMisfit = 2;    // sensors of their data sheet come to 0.9, at worst to 1.5
constexpr double kOpenTorque = 0.2;  // share of rated: enough to let the ligaments open the hand

motion::HandMotionOptions motion_options(const HandParts& hand) {
  motion::HandMotionOptions options;
  options.hand_link = hand.frame;
  return options;
}

Eigen::Isometry3d raised(const Eigen::Isometry3d& X_T, double height, double back = 0) {
  Eigen::Isometry3d out = X_T;
  out.translation() += Eigen::Vector3d(-back, 0, height);
  return out;
}

}  // namespace

Manipulator::Manipulator(const RobotModel& model, Session& session, const StageTwoParameters& parameters)
    : session_(session),
      parameters_(parameters),
      model_(model),
      hand_weight_(model, session.hand().force_torque),
      estimator_({.gain = parameters.sensor_gain,
                  .cross_talk = parameters.sensor_cross_talk,
                  .force_per_torque = parameters.sensor_force_per_torque,
                  .torque_per_force = parameters.sensor_torque_per_force,
                  .force_range = parameters.sensor_force_range,
                  .torque_range = parameters.sensor_torque_range}) {}

void Manipulator::start() {
  const std::vector<std::string>& joints = session_.joint_names();
  const motion::HandMotionOptions options = motion_options(session_.hand());
  if (const auto& stance = session_.stance()) {
    motion_.emplace(model_, joints, *stance, options);
  } else {
    motion_.emplace(model_, joints, Eigen::Isometry3d::Identity(), options);
  }
  motion_->reset(session_.link_positions());
  while (!motion_->balanced()) cycle();
  settle();
  X_TH_start_ = motion_->X_WH();
}

void Manipulator::cycle() {
  if (session_.stance()) {
    if (stabilised_recoveries_ != session_.recoveries()) stabiliser_.restart();
    stabilised_recoveries_ = session_.recoveries();
    const motion::KinematicTree& reference = motion_->kinematics();
    motion_->shift_com(stabiliser_.step(session_.balance(), reference.total_mass(), reference.com().head<2>(),
                                        session_.period()));
  }
  session_.tick(motion_->step(session_.period()));
}

void Manipulator::calibrate() {
  const Eigen::Matrix3d R_HS = (session_.X_TH().inverse() * session_.X_TS()).linear();
  const wrench::LoadEstimator before = estimator_;
  int recoveries;
  do {  // a sensor that booted anew in between has another residual
    recoveries = session_.recoveries();
    estimator_ = before;
    estimator_.begin_series();
    for (const double turn : {-parameters_.calibration_turn, parameters_.calibration_turn, 0.0}) {
      Eigen::Isometry3d X_TH = X_TH_start_;
      X_TH.rotate(Eigen::AngleAxisd(turn, R_HS.col(2)));
      move_to(X_TH, parameters_.travel_speed);
      add_empty();
    }
  } while (session_.recoveries() != recoveries);
}

Manipulator::MeanReading Manipulator::mean_reading(double seconds) {
  wrench::WrenchAverage reading, hand;
  Eigen::Vector3d down_S = Eigen::Vector3d::Zero();
  for_seconds(seconds, [&](double) {
    reading.add(session_.F_So_S());
    hand.add(hand_weight_.F_So_S(session_.measured()));
    down_S -= session_.X_TS().linear().transpose().col(2);
  });
  return {reading.mean(), hand.mean(), down_S.normalized(), reading.count()};
}

void Manipulator::set_table(const Eigen::Vector3d& normal_T, const std::vector<Eigen::Vector3d>& hull_T) {
  motion_->set_table(motion::ConvexPrism(normal_T, hull_T));
}

void Manipulator::for_seconds(double seconds, const std::function<void(double)>& each_cycle) {
  const int cycles = static_cast<int>(std::lround(seconds / session_.period()));
  for (int i = 1; i <= cycles; ++i) {
    if (each_cycle) each_cycle(static_cast<double>(i) / cycles);
    cycle();
  }
}

void Manipulator::hold(double seconds) { for_seconds(seconds, nullptr); }

void Manipulator::settle() {
  motion::RestWatch watch(parameters_.rest_speed, parameters_.rest_time);
  double waited = 0;
  while (!watch.at_rest(session_.X_TH().translation(), session_.period())) {
    if (waited > parameters_.rest_timeout) {
      throw RunStopped(
          fmt::format("the hand does not come to rest: {:.0f} s after a motion it still reaches {:.1f} mm/s",
                      waited, 1e3 * watch.unrest()));
    }
    cycle();
    waited += session_.period();
  }
}

motion::MotionLimits Manipulator::carrying_limits() const {
  motion::MotionLimits limits;
  limits.linear_velocity = parameters_.lift_speed;
  limits.angular_velocity = parameters_.angular_speed;
  limits.duration = parameters_.carry_time;
  return limits;
}

void Manipulator::carry_to(const Eigen::Isometry3d& X_TH) { move_to(X_TH, carrying_limits()); }

void Manipulator::move_to(const Eigen::Isometry3d& X_TH, double speed) {
  motion::MotionLimits limits;
  limits.linear_velocity = speed;
  limits.angular_velocity = parameters_.angular_speed;
  move_to(X_TH, limits);
}

void Manipulator::move_to(const Eigen::Isometry3d& X_TH, const motion::MotionLimits& limits) {
  const auto refuse = [&](const std::string& reason) {
    const Eigen::Vector3d p = X_TH.translation();
    throw RunStopped(
        fmt::format("the hand cannot reach ({:.3f}, {:.3f}, {:.3f}) m from where the base stood: {}", p.x(),
                    p.y(), p.z(), reason));
  };
  const motion::HandMotion::Reach ahead = motion_->reachable(X_TH, limits);
  if (ahead.status != motion::HandMotion::Status::kReached) {
    refuse(fmt::format("the motion would end {:.0f} mm short", 1e3 * ahead.error.position));
  }
  motion_->go_to(X_TH, limits);
  while (!motion_->done()) cycle();
  if (motion_->status() != motion::HandMotion::Status::kReached) refuse(motion_->describe());
}

void Manipulator::retreat() { move_to(X_TH_start_, parameters_.travel_speed); }

void Manipulator::approach(const Eigen::Isometry3d& X_TG) {
  session_.set_grip(0, kOpenTorque);
  move_to(raised(X_TG, parameters_.approach_height, parameters_.approach_back), parameters_.travel_speed);
  move_to(raised(X_TG, parameters_.approach_height), parameters_.travel_speed);
}

void Manipulator::tare() {
  estimator_.begin_series();
  const MeanReading empty = add_empty();
  residual_So_S_ = {empty.reading.torque - empty.hand.torque, empty.reading.force - empty.hand.force};
}

void Manipulator::descend(const Eigen::Isometry3d& X_TG) {
  X_TH_grasp_ = X_TG;
  X_TH_grasp_.translation() += parameters_.palm_clearance * X_TG.linear().col(1);
  move_to(X_TH_grasp_, parameters_.approach_speed);
  hold(parameters_.hold_time);
}

void Manipulator::ascend() {
  move_to(raised(X_TH_grasp_, parameters_.approach_height), parameters_.approach_speed);
}

void Manipulator::grasp() {
  session_.set_holding(true);
  for_seconds(parameters_.close_time,
              [&](double share) { session_.set_grip(share, parameters_.grip_torque); });
  hold(parameters_.hold_time);
  if (session_.hand_closure() > parameters_.empty_closure) {
    throw RunStopped(fmt::format("the hand closed to {:.0f} % of its travel and holds nothing",
                                 100 * session_.hand_closure()));
  }
  lifted_ = 0;
}

void Manipulator::lift() {
  const auto rise_to = [&](double height) {
    lifted_ = height;
    carry_to(raised(X_TH_grasp_, height));
    settle();
    return mean_object_load(parameters_.lift_window);
  };
  const Wrench first = rise_to(parameters_.lift_height);
  carry(first);
  double force = first.force.norm();
  while (true) {
    const double next = lifted_ + parameters_.lift_step;
    if (next > parameters_.lift_max + 1e-9) {
      throw RunStopped(
          fmt::format("the wrist force still changes with height at {:.2f} m: the object rests on "
                      "something or slips",
                      lifted_));
    }
    const double higher = rise_to(next).force.norm();
    const double change = std::abs(higher - force);
    force = higher;
    if (change <= parameters_.lift_force_change) break;
  }
  if (force < parameters_.min_force) {
    throw RunStopped(
        fmt::format("the wrist weighs {:.2f} N after the lift: the object is not in the hand", force));
  }
}

void Manipulator::carry(const Wrench& F_Ho_T) {
  const auto line = wrench::com_line(F_Ho_T, parameters_.min_force);
  if (!line) return;
  payload_ = {F_Ho_T.force.norm() / motion::kGravity, session_.X_TH().linear().transpose() * line->p_PF};
  for_seconds(parameters_.payload_time,
              [&](double share) { motion_->set_payload(share * payload_.mass, payload_.p_HCm); });
}

Wrench Manipulator::object_load() const {
  const Wrench hand = hand_weight_.F_So_S(session_.measured());
  const Wrench& reading = session_.F_So_S();
  const Eigen::Isometry3d& X_TS = session_.X_TS();
  const Wrench F_So_T{X_TS.linear() * (reading.torque - residual_So_S_.torque - hand.torque),
                      X_TS.linear() * (reading.force - residual_So_S_.force - hand.force)};
  return wrench::shift(F_So_T, session_.X_TH().translation() - X_TS.translation());
}

Wrench Manipulator::mean_object_load(double seconds) {
  wrench::WrenchAverage average;
  for_seconds(seconds, [&](double) { average.add(object_load()); });
  return average.mean();
}

void Manipulator::turn() {
  const Eigen::Isometry3d X_TH = raised(X_TH_grasp_, lifted_);
  for (const double turn : {-parameters_.weighing_turn, parameters_.weighing_turn}) {
    Eigen::Isometry3d turned = X_TH;
    turned.rotate(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitX()));
    carry_to(turned);
    settle();
    add_loaded(parameters_.tare_time);
  }
  carry_to(X_TH);
  settle();
}

Manipulator::MeanReading Manipulator::add_empty() {
  settle();
  MeanReading empty = mean_reading(parameters_.tare_time);
  estimator_.add_empty(empty.reading, empty.count, empty.hand, empty.down_S);
  return empty;
}

void Manipulator::add_loaded(double seconds) {
  const MeanReading loaded = mean_reading(seconds);
  estimator_.add_loaded(loaded.reading, loaded.count, loaded.hand, loaded.down_S);
}

Wrench Manipulator::weigh() {
  add_loaded(parameters_.average_time);
  const wrench::LoadEstimator::Object object = estimator_.object();
  if (!(object.misfit < kMostMisfit)) {
    throw RunStopped(fmt::format(
        "the wrist's readings contradict each other: with the hand turned they are {:.1f} standard "
        "deviations away from what any one object would make, expected less than {:g}",
        object.misfit, kMostMisfit));
  }
  const Eigen::Isometry3d& X_TS = session_.X_TS();
  const Eigen::Vector3d down_T = -Eigen::Vector3d::UnitZ();
  return wrench::shift({(X_TS.linear() * object.moment_S).cross(down_T), object.weight * down_T},
                       session_.X_TH().translation() - X_TS.translation());
}

void Manipulator::hang() {
  const wrench::LoadEstimator::Object object = estimator_.object();
  const Eigen::Isometry3d X_HT = session_.X_TH().inverse();
  const Eigen::Vector3d p_HCm = X_HT * (session_.X_TS() * Eigen::Vector3d(object.moment_S / object.weight));
  const Eigen::Vector3d down_H = -X_HT.linear().col(2);
  const double turn = std::remainder(std::atan2(down_H.z(), down_H.y()) - std::atan2(p_HCm.z(), p_HCm.y()),
                                     2 * std::numbers::pi);
  const double most = parameters_.hanging_turn;
  for (const double share : {1.0, 0.75, 0.5, 0.25}) {
    Eigen::Isometry3d X_TH = raised(X_TH_grasp_, lifted_);
    X_TH.rotate(Eigen::AngleAxisd(share * std::clamp(turn, -most, most), Eigen::Vector3d::UnitX()));
    if (motion_->reachable(X_TH, carrying_limits()).status != motion::HandMotion::Status::kReached) continue;
    carry_to(X_TH);
    settle();
    return;
  }
}

Eigen::Isometry3d Manipulator::lower_and_release() {
  carry_to(X_TH_grasp_);
  hold(parameters_.hold_time);
  Eigen::Isometry3d X_TH = session_.X_TH();
  for_seconds(parameters_.close_time, [&](double share) {
    session_.set_grip(1 - share, parameters_.grip_torque);
    motion_->set_payload((1 - share) * payload_.mass, payload_.p_HCm);
  });
  session_.set_grip(0, kOpenTorque);
  hold(parameters_.hold_time);
  session_.set_holding(false);
  ascend();
  lifted_ = 0;
  return X_TH;
}

}  // namespace walkman::regrasp
