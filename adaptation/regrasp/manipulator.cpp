#include "adaptation/regrasp/manipulator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

#include "adaptation/motion/grip.h"
#include "adaptation/motion/rest_watch.h"
#include "adaptation/wrench/carried_load.h"

namespace walkman::regrasp {
namespace {

constexpr double kMostMisfit = 2;        // sensors of their data sheet come to 0.9, at worst to 1.5
constexpr double kLooksThere = 0.03;     // rad off the middle of the image
constexpr double kHeadSpeed = 0.15;      // rad/s
constexpr double kPeakOverMean = 1.875;  // speed of a fifth-order motion
constexpr int kMostCorrections = 5;
constexpr double kRestless = 2;  // times as fast as a hand at rest, when it takes long to come to rest
constexpr double kPlaced = 0.0004, kTurned = 0.003;  // m, rad: as near as a hand has to be
constexpr int kPutDownSteps = 8;
constexpr double kPutDownStep = 0.003;                // m
constexpr double kPutDownWindow = 0.2;                // s
constexpr double kPutDownShare = 0.5;                 // of its weight that the hand may still carry
constexpr std::array kHigher = {0.0, 0.1, 0.2, 0.3};  // m
constexpr double kOverTable = 0.02;                   // m, of what turns
constexpr double kFarthestEnd = 1.0;  // m beside the hand, of an object that goes on where the image ends
// How an object turns about its handle in the fingers: when they close, rad, and with its weight, N·m/rad.
// Estimates for SoftHands go from 0.1 to 1, and nobody has measured it: this is the softest. With its weight
// it turns until the centre of mass is straight below, at most.
constexpr double kClosingTurn = 0.1, kSoftest = 0.1, kFarthestTurned = std::numbers::pi / 2;
constexpr double kTurnStep = 0.05;  // rad
// How the hand sits on its sensor: screws of both have 0.2 mm of clearance on 45 mm.
constexpr double kMountingTurn = 0.005;     // rad
constexpr double kMountingOrigin = 0.0006;  // m
// Of a bar: how many radii from its handle's axis it reaches at most; how well its radius is seen; and how
// straight it is: a tube bends by 0.2 % of its length at most (EN 10219-2), which takes the centre of mass a
// third as far off the axis in its middle.
constexpr double kBar = 2;
constexpr double kRadiusError = 0.001;  // m
constexpr double kBend = 0.002 / 3;     // of its length
constexpr double kDensest = 7850;       // kg/m³, steel
constexpr double kDeviations = 3;       // of what is not chance
constexpr double kOpenTorque = 0.2;     // share of rated: enough to let the ligaments open the hand

wrench::LoadEstimator::DataSheet sensor_of(const StageTwoParameters& parameters) {
  return {.gain = parameters.sensor_gain,
          .axial_gain = parameters.sensor_axial_gain,
          .cross_talk = parameters.sensor_cross_talk,
          .force_per_torque = parameters.sensor_force_per_torque,
          .torque_per_force = parameters.sensor_torque_per_force,
          .force_range = parameters.sensor_force_range,
          .torque_range = parameters.sensor_torque_range};
}

Eigen::Quaterniond about_handle(double angle) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX()));
}

Eigen::Isometry3d raised(const Eigen::Isometry3d& X_T, double height) {
  Eigen::Isometry3d out = X_T;
  out.translation().z() += height;
  return out;
}

}  // namespace

Manipulator::Manipulator(const KnownRobot& known, Session& session, const StageTwoParameters& parameters)
    : session_(session),
      parameters_(parameters),
      known_(known),
      hand_weight_(known.model, session.hand().force_torque),
      estimator_(sensor_of(parameters)) {
  if (known.description.gaze) gaze_.emplace(known, session.joint_names());
}

void Manipulator::take_over(const Eigen::VectorXd& q, const Eigen::VectorXd& q_stood) {
  const std::vector<std::string>& joints = session_.joint_names();
  const motion::HandMotionOptions options = motion::hand_motion_options(known_, session_.hand());
  if (const auto& stance = session_.stance()) {
    motion_.emplace(known_.model, joints, *stance, options);
  } else {
    motion_.emplace(known_.model, joints, Eigen::Isometry3d::Identity(), options);
  }
  motion_->set_obstacles(obstacles_);
  motion_->reset(q, q_stood);
  margins_ = {wider(options.margins), options.margins};
}

void Manipulator::use(std::size_t hand) {
  if (hand == hand_) return;
  hand_ = hand;
  session_.use(known_.description.working_hands().at(hand));
  const Eigen::VectorXd q = motion_->q_ref(), q_stood = motion_->q_stood();
  take_over(q, q_stood);
  X_TH_start_ = motion_->X_WH();
  hand_weight_ = wrench::HandWeight(known_.model, session_.hand().force_torque);
  estimator_ = wrench::LoadEstimator(sensor_of(parameters_));
  session_.enter(Phase::kCalibrate);
  calibrate();
}

void Manipulator::start() {
  const Eigen::VectorXd q = session_.link_positions();
  take_over(q, q);
  while (!motion_->balanced()) cycle();
  settle();
  session_.require_sound_encoders();
  X_TH_start_ = motion_->X_WH();
  q_start_ = motion_->q_ref();
}

void Manipulator::cycle() {
  if (session_.stance()) {
    if (stabilised_recoveries_ != session_.recoveries()) {
      stabiliser_.restart();
      twist_damper_.restart();
    }
    stabilised_recoveries_ = session_.recoveries();
    const motion::KinematicTree& reference = motion_->kinematics();
    motion_->shift_com(stabiliser_.step(session_.balance(), reference.total_mass(), reference.com().head<2>(),
                                        session_.period()));
    motion_->twist(twist_damper_.step(motion_->twist_of(session_.measured()), session_.period()));
  }
  session_.tick(motion_->step(session_.period()));
  if (lifting_) require_strength();
}

void Manipulator::require_strength() const {
  const auto overload = session_.overload();
  if (!overload) return;
  const Wrench load = object_load();
  throw HeldTooFar(
      fmt::format(
          "{} has to give {:.1f} N·m while the wrist carries {:.1f} N and {:.2f} N·m, expected at most "
          "{:.1f} N·m, a tenth above what its motor can give for good: the object is too heavy or too far "
          "beside "
          "the hand",
          overload->joint, overload->torque, load.force.norm(), load.torque.norm(), overload->most),
      load);
}

const Eigen::Isometry3d& Manipulator::roomier(const Eigen::Isometry3d& X_TH,
                                              const Eigen::Isometry3d& X_TH_else) {
  const auto room = [&](const Eigen::Isometry3d& X) {
    const motion::HandMotion::Reach reach = motion_->reachable(X, limits(parameters_.travel_speed));
    return reach.status == motion::HandMotion::Status::kReached ? room_of(reach) : -1;
  };
  return room(X_TH_else) > room(X_TH) ? X_TH_else : X_TH;
}

void Manipulator::calibrate() {
  const Eigen::Matrix3d R_HS = (session_.X_TH().inverse() * session_.X_TS()).linear();
  const wrench::LoadEstimator before = estimator_;
  int recoveries;
  motion_->keep_posture(true);  // the camera looks from where it is
  do {                          // a sensor that booted anew in between has another residual
    recoveries = session_.recoveries();
    estimator_ = before;
    estimator_.begin_series();
    const double turn = parameters_.calibration_turn;
    const auto turned = [&](double angle, const Eigen::Vector3d& axis_H) {
      Eigen::Isometry3d X_TH = X_TH_start_;
      X_TH.rotate(Eigen::AngleAxisd(angle, axis_H));
      return X_TH;
    };
    const auto weigh_empty = [&](const Eigen::Isometry3d& X_TH) {
      move_to(X_TH, parameters_.travel_speed);
      add_empty(parameters_.pose_time);
    };
    weigh_empty(turned(-turn, R_HS.col(2)));
    weigh_empty(roomier(turned(turn, R_HS.col(0)), turned(-turn, R_HS.col(0))));
    weigh_empty(turned(turn, R_HS.col(2)));
    weigh_empty(X_TH_start_);
  } while (session_.recoveries() != recoveries);
  motion_->keep_posture(false);
  if (const double misfit = estimator_.object().misfit; !(misfit < kMostMisfit)) {
    throw Refused(fmt::format(
        "the wrist's readings of the empty hand contradict its weight: turned four ways, they are "
        "{:.1f} standard deviations away from what it would make, expected less than {:g}: the "
        "sensor is wrong",
        misfit, kMostMisfit));
  }
}

Manipulator::MeanReading Manipulator::mean_reading(double seconds) {
  wrench::WrenchAverage reading, hand;
  wrench::WrenchTrend trend;
  Eigen::Vector3d down_S = Eigen::Vector3d::Zero();
  seconds *= longer_;
  for_seconds(seconds, [&](double share) {
    reading.add(session_.F_So_S());
    trend.add(share * seconds, session_.F_So_S());
    hand.add(hand_weight_.F_So_S(session_.measured()));
    down_S -= session_.X_TS().linear().transpose().col(2);
  });
  return {reading.mean(), hand.mean(), trend.slope(), down_S.normalized(), reading.count()};
}

void Manipulator::set_obstacles(const std::vector<motion::NamedObstacle>& obstacles) {
  obstacles_ = obstacles;
  motion_->set_obstacles(obstacles);
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
  motion::RestWatch less(kRestless * parameters_.rest_speed, parameters_.rest_time);
  double waited = 0;
  longer_ = 1;
  while (!watch.at_rest(session_.X_TH().translation(), session_.period())) {
    // A mean over a longer time is as good of a hand that is that much faster.
    if (less.at_rest(session_.X_TH().translation(), session_.period()) &&
        waited > parameters_.rest_timeout / 2) {
      longer_ = kRestless;
      break;
    }
    if (waited > parameters_.rest_timeout) {
      const std::string reason =
          fmt::format("the hand does not come to rest: {:.0f} s after a motion it still reaches {:.1f} mm/s",
                      waited, 1e3 * watch.unrest());
      if (lifting_ || payload_.mass > 0) throw HeldTooFar(reason, mean_object_load(parameters_.lift_window));
      throw Refused(reason);
    }
    cycle();
    waited += session_.period();
  }
}

motion::MotionLimits Manipulator::limits(double speed) const {
  motion::MotionLimits bounds;
  bounds.linear_velocity = speed;
  bounds.angular_velocity = parameters_.angular_speed;
  return bounds;
}

motion::MotionLimits Manipulator::carrying_limits() const {
  motion::MotionLimits carrying = limits(parameters_.lift_speed);
  carrying.duration = parameters_.carry_time;
  return carrying;
}

void Manipulator::carry_to(const Eigen::Isometry3d& X_TH) { move_to(X_TH, carrying_limits()); }

void Manipulator::move_to(const Eigen::Isometry3d& X_TH, double speed) { move_to(X_TH, limits(speed)); }

void Manipulator::move_to(const Eigen::Isometry3d& X_TH, const motion::MotionLimits& bounds) {
  std::string reason;
  for (const motion::GuardMargins& margins : margins_) {
    motion_->set_margins(margins);
    const Route route = find_route(*motion_, std::span(&X_TH, 1), bounds, 0);
    if (follow(route, bounds)) return;
    reason =
        route.reach.status == motion::HandMotion::Status::kReached ? motion_->describe() : route.reach.reason;
  }
  const Eigen::Vector3d p = X_TH.translation();
  throw WayBlocked(
      fmt::format("the {} hand cannot reach ({:.3f}, {:.3f}, {:.3f}) m from where the base stood: {}",
                  session_.hand().name, p.x(), p.y(), p.z(), reason));
}

bool Manipulator::go_straight(const Eigen::Isometry3d& X_TH, const motion::MotionLimits& bounds) {
  for (const motion::GuardMargins& margins : margins_) {
    motion_->set_margins(margins);
    if (follow(straight_route(*motion_, std::span(&X_TH, 1), bounds), bounds)) return true;
  }
  return false;
}

bool Manipulator::follow(const Route& route, const motion::MotionLimits& bounds) {
  if (route.reach.status != motion::HandMotion::Status::kReached) return false;
  for (const Eigen::Isometry3d& X_TV : route.way) {
    motion_->go_to(X_TV, bounds);
    while (!motion_->done()) cycle();
    if (motion_->status() != motion::HandMotion::Status::kReached) return false;
  }
  return true;
}

void Manipulator::retreat() {
  const auto go = [&](const Eigen::Isometry3d& X_TH) {
    try {
      move_to(X_TH, parameters_.travel_speed);
    } catch (const WayBlocked&) {
      return false;
    }
    return true;
  };
  for (auto pose = way_.rbegin(); pose != way_.rend(); ++pose) static_cast<void>(go(*pose));
  // A table may have turned out to be in the way where the hand came from.
  for (const double higher : kHigher) {
    if (!go(raised(X_TH_start_, higher))) continue;
    if (higher == 0) return_to_start();
    return;
  }
}

/// The pose of the hand alone leaves the torso leaning as the last grasp had it, and from there a hand may
/// find no way to what it can reach from where the robot stood up.
void Manipulator::return_to_start() {
  motion_->return_to(q_start_);
  while (!motion_->done()) cycle();
}

void Manipulator::approach(const std::vector<Eigen::Isometry3d>& way) {
  session_.set_grip(0, kOpenTorque);
  way_.clear();
  for (const Eigen::Isometry3d& X_TH : way) {
    move_to(X_TH, parameters_.travel_speed);
    way_.push_back(X_TH);
  }
}

bool Manipulator::look_at(const Eigen::Vector3d& p_T) {
  if (!gaze_) return false;
  const auto way = gaze_->towards(motion_->q_ref(), session_.X_TC().inverse() * p_T);
  if ((way.back() - motion_->q_ref()).cwiseAbs().maxCoeff() < kLooksThere) return false;
  for (const Eigen::VectorXd& q : way) turn_head(q);
  settle();
  return true;
}

void Manipulator::turn_head(const Eigen::VectorXd& q) {
  const Eigen::VectorXd q_from = motion_->q_ref();
  const double angle = (q - q_from).cwiseAbs().maxCoeff();
  for_seconds(kPeakOverMean * angle / kHeadSpeed, [&](double share) {
    const double smooth = share * share * share * (10 + share * (6 * share - 15));
    for (const int dof : {gaze_->pan(), gaze_->tilt()})
      motion_->place_joint(dof, q_from[dof] + smooth * (q[dof] - q_from[dof]));
  });
}

void Manipulator::tare() {
  estimator_.begin_series();
  tared_recoveries_ = session_.recoveries();
  const MeanReading empty = add_empty(parameters_.tare_time);
  residual_So_S_ = {empty.reading.torque - empty.hand.torque, empty.reading.force - empty.hand.force};
}

Eigen::Isometry3d Manipulator::reference_for(const Eigen::Isometry3d& X_TH) const {
  return X_TH * session_.X_TH().inverse() * motion_->X_WH();
}

void Manipulator::descend(const Eigen::Isometry3d& X_TH) {
  const motion::MotionLimits slowly = limits(parameters_.approach_speed);
  if (!go_straight(reference_for(X_TH), slowly)) move_to(X_TH, slowly);
  for (int correction = 0; correction < kMostCorrections; ++correction) {
    settle();
    const Eigen::Isometry3d left = session_.X_TH().inverse() * X_TH;
    if (left.translation().norm() <= kPlaced && Eigen::AngleAxisd(left.linear()).angle() <= kTurned) break;
    if (!go_straight(reference_for(X_TH), slowly)) break;
  }
  X_TH_grasp_ = motion_->X_WH();
}

void Manipulator::ascend() {
  move_to(X_TH_grasp_ * Eigen::Translation3d(0, parameters_.approach_height, 0), parameters_.approach_speed);
}

void Manipulator::grasp(double radius, const Eigen::AlignedBox3d& object_H) {
  object_H_ = object_H;
  bar_radius_.reset();
  const Eigen::Vector3d p_HAxis(0, -radius - parameters_.palm_clearance, 0);
  const double farthest = std::max((p_HAxis - object_H.min()).tail<2>().maxCoeff(),
                                   (object_H.max() - p_HAxis).tail<2>().maxCoeff());
  if (farthest < kBar * radius) bar_radius_ = radius;
  session_.set_holding(true);
  for_seconds(parameters_.close_time,
              [&](double share) { session_.set_grip(share, parameters_.grip_torque); });
  hold(parameters_.hold_time);
  if (session_.hand_closure() > parameters_.empty_closure) {
    throw Refused(fmt::format("the hand closed to {:.0f} % of its travel and holds nothing",
                              100 * session_.hand_closure()));
  }
  const HandParts& hand = session_.hand();
  hand_weight_.hold(hand.frame, motion::Grip(known_.model, hand.frame, hand.motor).around(radius));
  lifted_ = 0;
}

void Manipulator::lift() {
  lifting_ = true;
  const auto rise_to = [&](double height) {
    lifted_ = height;
    carry_to(raised(X_TH_grasp_, height));
    settle();
    return mean_object_load(parameters_.lift_window);
  };
  Wrench load = rise_to(parameters_.lift_height);
  carry(load);
  double change = 0;
  while (true) {
    const double next = lifted_ + parameters_.lift_step;
    if (next > parameters_.lift_max + 1e-9) {
      throw HeldTooFar(
          fmt::format(
              "at {:.2f} m the wrist carries {:.1f} N and {:.2f} N·m, {:.2f} N more or less than {:.0f} cm "
              "below, expected at most {:g} N: the object turns in the hand or still rests on something",
              lifted_, load.force.norm(), load.torque.norm(), change, 100 * parameters_.lift_step,
              parameters_.lift_force_change),
          load);
    }
    const Wrench higher = rise_to(next);
    change = std::abs(higher.force.norm() - load.force.norm());
    load = higher;
    if (change <= parameters_.lift_force_change) break;
  }
  const double force = load.force.norm();
  if (force < parameters_.min_force) {
    throw Refused(
        fmt::format("the wrist weighs {:.2f} N after the lift: the object is not in the hand", force));
  }
  lifting_ = false;
}

void Manipulator::require_of_object(const Wrench& F_Ho_T) const {
  // The gains of force and torque, each as its data sheet has it, over the lever from the sensor.
  const double lever = (session_.X_TH().translation() - session_.X_TS().translation()).norm();
  require_of_object(F_Ho_T, std::numbers::sqrt2 * parameters_.sensor_gain * lever * F_Ho_T.force.norm());
}

void Manipulator::require_of_object(const Wrench& F_Ho_T, double torque_deviation) const {
  const auto line = wrench::com_line(F_Ho_T, parameters_.min_force);
  if (!line) return;
  const double force = F_Ho_T.force.norm(), torque = F_Ho_T.torque.norm();
  const double heaviest = kDensest * object_H_.volume() * motion::kGravity;
  if (!(force <= heaviest)) {
    throw Refused(fmt::format(
        "by the wrist the object weighs {:.1f} N, expected at most the {:.1f} N of solid steel of the size "
        "seen: no object that hangs there gives such readings",
        force, heaviest));
  }
  const Eigen::Matrix3d R_HT = session_.X_TH().linear().transpose();
  const double beside = wrench::distance_of({R_HT * line->p_PF, R_HT * line->direction}, object_H_);
  const double bound = parameters_.displacement_threshold + kDeviations * torque_deviation / force;
  if (beside <= bound) return;
  throw Refused(
      fmt::format("by {:.1f} N and {:.2f} N·m at the wrist the centre of mass would be {:.0f} mm outside of "
                  "the object seen, expected at most {:.0f} mm: these readings are of no weight that hangs "
                  "there",
                  force, torque, 1e3 * beside, 1e3 * bound));
}

void Manipulator::carry(const Wrench& F_Ho_T) {
  const auto line = wrench::com_line(F_Ho_T, parameters_.min_force);
  if (!line) return;
  require_of_object(F_Ho_T);
  const Payload before = payload_;
  const Payload load{F_Ho_T.force.norm() / motion::kGravity,
                     session_.X_TH().linear().transpose() * line->p_PF};
  for_seconds(parameters_.payload_time, [&](double share) {
    payload_ = {(1 - share) * before.mass + share * load.mass, load.p_HCm};
    motion_->set_payload(payload_.mass, payload_.p_HCm);
  });
}

Wrench Manipulator::object_load() const {
  return load_of(session_.F_So_S(), hand_weight_.F_So_S(session_.measured()));
}

Wrench Manipulator::load_of(const Wrench& reading, const Wrench& hand) const {
  const Eigen::Isometry3d& X_TS = session_.X_TS();
  const Wrench F_So_T{X_TS.linear() * (reading.torque - residual_So_S_.torque - hand.torque),
                      X_TS.linear() * (reading.force - residual_So_S_.force - hand.force)};
  return wrench::shift(F_So_T, session_.X_TH().translation() - X_TS.translation());
}

Wrench Manipulator::mean_object_load(double seconds) {
  wrench::WrenchAverage average;
  for_seconds(longer_ * seconds, [&](double) { average.add(object_load()); });
  return average.mean();
}

Eigen::Isometry3d Manipulator::turned_clear(const Eigen::Quaterniond& turn) const {
  const Eigen::Vector3d up_H = X_TH_grasp_.linear().transpose().col(2);
  const auto lowest = [&](const Eigen::Quaterniond& R) {
    const Eigen::Array3d up = (R.inverse() * up_H).array();
    const Eigen::Array3d low = object_H_.min().array().max(-kFarthestEnd);
    const Eigen::Array3d high = object_H_.max().array().min(kFarthestEnd);
    return (up * low).min(up * high).sum();
  };
  // Of the weight about the handle: the way it turns the object.
  const double torque = -payload_.mass * motion::kGravity * payload_.p_HCm.cross(up_H).x();
  const double droop = std::min(std::abs(torque) / kSoftest, kFarthestTurned - kClosingTurn);
  const double from = std::min(0.0, std::copysign(droop, torque)) - kClosingTurn;
  const double to = std::max(0.0, std::copysign(droop, torque)) + kClosingTurn;
  double turned = lowest(turn);
  double angle = from;
  while (angle < to + kTurnStep) {
    turned = std::min(turned, lowest(turn * about_handle(std::min(angle, to))));
    angle += kTurnStep;
  }
  const double needed = lowest(Eigen::Quaterniond::Identity()) - turned + kOverTable;
  Eigen::Isometry3d X_TH = raised(X_TH_grasp_, std::max(lifted_, needed));
  X_TH.rotate(turn);
  return X_TH;
}

void Manipulator::turn() {
  const Eigen::Isometry3d X_TH = raised(X_TH_grasp_, lifted_);
  for (const double turn : {-parameters_.weighing_turn, parameters_.weighing_turn}) {
    if (!go_straight(turned_clear(about_handle(turn)), carrying_limits()))
      carry_to(turned_clear(about_handle(turn / 2)));
    settle();
    add_loaded(parameters_.pose_time);
  }
  carry_to(X_TH);
  settle();
}

Manipulator::MeanReading Manipulator::add_empty(double seconds) {
  settle();
  MeanReading empty = mean_reading(seconds);
  estimator_.add_empty(empty.reading, empty.count, empty.hand, empty.down_S);
  return empty;
}

Manipulator::MeanReading Manipulator::add_loaded(double seconds) {
  MeanReading loaded = mean_reading(seconds);
  estimator_.add_loaded(loaded.reading, loaded.count, loaded.hand, loaded.down_S);
  return loaded;
}

wrench::LoadEstimator::Object Manipulator::object() const {
  wrench::LoadEstimator::Object object = estimator_.object();
  const Eigen::Isometry3d X_HS = session_.X_TH().inverse() * session_.X_TS();
  const double mounting = std::hypot(kMountingTurn * X_HS.translation().norm(), kMountingOrigin);
  object.covariance.diagonal().tail<3>().array() += std::pow(object.weight * mounting, 2);
  const double along = X_HS.linear().row(0).dot(object.moment_S) / object.weight + X_HS.translation().x();
  if (!bar_radius_ || std::abs(along) > parameters_.displacement_threshold) return object;
  const double length =
      std::min(object_H_.max().x(), kFarthestEnd) - std::max(object_H_.min().x(), -kFarthestEnd);
  const Eigen::Vector4d errors(motion::Grip::kSeatDeviation,
                               motion::Grip::seat(0) - motion::Grip::seat(kRadiusError),
                               object.weight / motion::Grip::kFirmness, kBend * length);
  return wrench::near_plane(std::move(object), X_HS.linear().row(2).transpose(),
                            motion::Grip::seat(*bar_radius_) - X_HS.translation().z(), errors.norm(),
                            kDeviations);
}

Manipulator::Load Manipulator::weigh() {
  const MeanReading level = add_loaded(parameters_.average_time);
  weighed_So_S_ = level.reading;
  const Wrench load = load_of(level.reading, level.hand);
  if (level.slope.force.norm() > parameters_.force_slope ||
      level.slope.torque.norm() > parameters_.torque_slope) {
    throw HeldTooFar(
        fmt::format(
            "the wrist's reading does not stay what it is: by {:.2f} N and {:.3f} N·m it changes per second "
            "while the object hangs still, expected less than {:g} and {:g}: the sensor drifts, or the "
            "object "
            "slips",
            level.slope.force.norm(), level.slope.torque.norm(), parameters_.force_slope,
            parameters_.torque_slope),
        load);
  }
  const wrench::LoadEstimator::Object object = this->object();
  if (!(object.misfit < kMostMisfit)) {
    throw HeldTooFar(fmt::format("the wrist's readings contradict each other: with {:.1f} N and {:.2f} N·m "
                                 "and the hand turned they "
                                 "are {:.1f} standard deviations away from what any one object would make, "
                                 "expected less than {:g}: "
                                 "the sensor is wrong, or the object turns in the hand",
                                 load.force.norm(), load.torque.norm(), object.misfit, kMostMisfit),
                     load);
  }
  const Eigen::Isometry3d& X_TS = session_.X_TS();
  const Eigen::Vector3d down_T = -Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d p_SoHo_T = session_.X_TH().translation() - X_TS.translation();
  Eigen::Matrix4d slope = Eigen::Matrix4d::Zero();  // over weight and moment
  slope.topLeftCorner<3, 1>() = -p_SoHo_T.cross(down_T);
  for (int i = 0; i < 3; ++i) slope.block<3, 1>(0, 1 + i) = X_TS.linear().col(i).cross(down_T);
  slope(3, 0) = 1;
  const Eigen::Matrix4d covariance = slope * object.covariance * slope.transpose();
  return {wrench::shift({(X_TS.linear() * object.moment_S).cross(down_T), object.weight * down_T}, p_SoHo_T),
          covariance};
}

void Manipulator::hang() {
  const wrench::LoadEstimator::Object object = this->object();
  const Eigen::Isometry3d X_HT = session_.X_TH().inverse();
  const Eigen::Vector3d p_HCm = X_HT * (session_.X_TS() * Eigen::Vector3d(object.moment_S / object.weight));
  const Eigen::Vector3d down_H = -X_HT.linear().col(2);
  const double most = parameters_.hanging_turn, most_roll = parameters_.hanging_roll;
  const double turn = std::remainder(std::atan2(down_H.z(), down_H.y()) - std::atan2(p_HCm.z(), p_HCm.y()),
                                     2 * std::numbers::pi);
  // From the handle's axis to the centre of mass, which is down when the hand has turned.
  const Eigen::Vector3d below_H(0, p_HCm.y(), p_HCm.z());
  const Eigen::Vector3d across_H = Eigen::Vector3d::UnitX().cross(below_H).normalized();
  // A place farther off is no place to hang it from: there a bar would have to be stood on its end.
  const double roll =
      std::abs(p_HCm.x()) > parameters_.displacement_threshold ? 0 : std::atan2(p_HCm.x(), below_H.norm());
  for (const double share : {1.0, 0.75, 0.5, 0.25}) {
    const Eigen::AngleAxisd rolled(share * std::clamp(roll, -most_roll, most_roll), across_H);
    const Eigen::Quaterniond turned = about_handle(share * std::clamp(turn, -most, most)) * rolled;
    if (!go_straight(turned_clear(turned), carrying_limits())) continue;
    settle();
    return;
  }
}

bool Manipulator::watch() {
  // Half of what would make a regrasp worth while.
  const double torque_change =
      parameters_.displacement_threshold / 2 * (weighed_So_S_.force - residual_So_S_.force).norm();
  const auto windows = static_cast<int>(std::ceil(parameters_.watch_time / parameters_.lift_window));
  for (int i = 0; i < windows; ++i) {
    const Wrench now = mean_reading(parameters_.lift_window).reading;
    if ((now.force - weighed_So_S_.force).norm() > parameters_.lift_force_change ||
        (now.torque - weighed_So_S_.torque).norm() > torque_change)
      return true;
  }
  return false;
}

void Manipulator::take_up() {
  settle();
  carry(mean_object_load(parameters_.lift_window));
  estimator_.change_load();
}

void Manipulator::check_residual() {
  if (session_.recoveries() != tared_recoveries_) return;  // one that booted anew has another
  settle();
  const MeanReading empty = mean_reading(parameters_.tare_time);
  const Wrench drift{empty.reading.torque - empty.hand.torque - residual_So_S_.torque,
                     empty.reading.force - empty.hand.force - residual_So_S_.force};
  if (drift.force.norm() <= parameters_.force_drift && drift.torque.norm() <= parameters_.torque_drift)
    return;
  throw Refused(fmt::format(
      "the wrist sensor's residual is {:.2f} N and {:.3f} N·m beside what it was before the grasp, expected "
      "at "
      "most {:g} and {:g}: it drifts, and what it weighed is not to be believed",
      drift.force.norm(), drift.torque.norm(), parameters_.force_drift, parameters_.torque_drift));
}

/// What has moved in the hand does not stand where it stood with the hand where it was.
void Manipulator::put_down() {
  // Upward force of the hand on the object, N: negative when the hand presses it on the table.
  const auto lifting_force = [this](double seconds) { return -mean_object_load(seconds).force.z(); };
  // What was too much to be taken over has a weight, too: without one the hand would press it on the table.
  const double weight =
      payload_.mass > 0 ? payload_.mass * motion::kGravity : std::abs(lifting_force(parameters_.lift_window));
  carry_to(X_TH_grasp_);
  hold(parameters_.hold_time);
  for (int step = 1; step <= kPutDownSteps; ++step) {
    if (lifting_force(kPutDownWindow) < kPutDownShare * weight ||
        !go_straight(raised(X_TH_grasp_, -step * kPutDownStep), limits(parameters_.approach_speed)))
      return;
  }
}

Eigen::Isometry3d Manipulator::lower_and_release() {
  lifting_ = false;
  put_down();
  Eigen::Isometry3d X_TH = session_.X_TH();
  // Without the load the hand rises to where it closed: a palm that is pressed on what is round rolls it
  // away.
  motion::MotionLimits rising = limits(parameters_.approach_speed);
  rising.duration = parameters_.close_time;
  motion_->go_to(X_TH_grasp_, rising);
  for_seconds(parameters_.close_time, [&](double share) {
    session_.set_grip(1 - share, parameters_.grip_torque);
    motion_->set_payload((1 - share) * payload_.mass, payload_.p_HCm);
  });
  session_.set_grip(0, kOpenTorque);
  hold(parameters_.hold_time);
  hand_weight_.hold(session_.hand().frame, {});
  session_.set_holding(false);
  payload_ = {};
  ascend();
  lifted_ = 0;
  return X_TH;
}

}  // namespace walkman::regrasp
