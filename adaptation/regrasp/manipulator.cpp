#include "adaptation/regrasp/manipulator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

#include <fmt/format.h>

#include "adaptation/motion/rest_watch.h"
#include "adaptation/wrench/carried_load.h"

namespace walkman::regrasp {
namespace {

constexpr double kLooksThere = 0.03;     // rad off the centre of the image
constexpr double kHeadSpeed = 0.15;      // rad/s
constexpr double kPeakOverMean = 1.875;  // of the speed of a fifth-order motion
constexpr int kMostCorrections = 5;
constexpr double kRestless = 2;  // times the speed of a hand at rest, if it takes long to come to rest
constexpr double kPlaced = 0.0004, kTurned = 0.003;  // m, rad: accuracy required of the hand
constexpr int kPutDownSteps = 8;
constexpr double kPutDownStep = 0.003;                // m
constexpr double kPutDownWindow = 0.2;                // s
constexpr double kPutDownShare = 0.5;                 // share of its weight that the hand may still carry
constexpr std::array kHigher = {0.0, 0.1, 0.2, 0.3};  // m
constexpr double kOverTable = 0.02;                   // m, clearance of a turned object
constexpr double kFarthestEnd = 1.0;  // m beside the hand, of an object that continues beyond the image
// How an object turns about its handle in the fingers: when they close, rad, and under its weight, N·m/rad.
// Estimates for SoftHands range from 0.1 to 1, and there is no measurement: this is the softest. Under its
// weight it turns at most until the centre of mass is straight below.
constexpr double kClosingTurn = 0.1, kSoftest = 0.1, kFarthestTurned = std::numbers::pi / 2;
constexpr double kTurnStep = 0.05;  // rad
constexpr std::string_view kNotFree = "the object turns in the hand or still rests on something";
// A contact this close to the grasp, m, is with the object itself: the camera locates it to some mm.
constexpr double kAtObject = 0.01;
constexpr int kTouchedCycles = 3;    // in a row: a single one may be a frame with a wrong bit
constexpr double kOpenTorque = 0.2;  // share of rated: enough to let the ligaments open the hand

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
    : session_(session), parameters_(parameters), known_(known), scale_(known, session, parameters_) {
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
  scale_.change_hand();
  session_.enter(Phase::kCalibrate);
  calibrate();
}

void Manipulator::start() {
  const Eigen::VectorXd q = session_.link_positions();
  take_over(q, q);
  while (!motion_->balanced()) cycle();
  settle();
  session_.require_sound_encoders();
  session_.begin_to_watch_arms();
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
  if (const auto touch = session_.new_touch()) {
    if (lifted_ > 0) throw Refused(*touch);
    throw RunStopped(*touch);
  }
  if (lifting_) require_strength();
  if (feeling_) require_untouched();
}

void Manipulator::require_untouched() {
  if (tared_recoveries_ != session_.recoveries()) return;  // a rebooted sensor has another residual
  if (p_TGrasp_ && (session_.X_TH().translation() - *p_TGrasp_).norm() < kAtObject) return;
  const double force = scale_.object_load().force.norm();
  touched_for_ = force > parameters_.touch_force ? touched_for_ + 1 : 0;
  if (touched_for_ < kTouchedCycles) return;
  touched_for_ = 0;
  throw WayBlocked(fmt::format(
      "the wrist sensor of the empty {} hand measures {:.1f} N besides the hand's weight, expected at most "
      "{:g} N: the hand meets something that was not seen, or the sensor is faulty",
      session_.hand().name, force, parameters_.touch_force));
}

void Manipulator::require_strength() const {
  const auto overload = session_.overload();
  if (!overload) return;
  const Wrench load = scale_.object_load();
  throw HeldTooFar(
      fmt::format(
          "{} has to exert {:.1f} N·m while the wrist carries {:.1f} N and {:.2f} N·m, expected at most "
          "{:.1f} N·m, a tenth above its motor's continuous torque: the object is too heavy or too far to "
          "one side of the hand",
          overload->joint, overload->torque, load.force.norm(), load.torque.norm(), overload->most),
      load);
}

void Manipulator::require_strength_for(const Route& route) const {
  if (payload_.mass <= 0) return;  // not known yet
  const auto overload = session_.overload(route.reach.torques);
  if (!overload) return;
  throw HeldTooFar(
      fmt::format(
          "{} would have to exert {:.1f} N·m for {:.1f} N in the hand at its destination, expected at most "
          "{:.1f} N·m, a tenth above its motor's continuous torque: the object is too heavy or too far to "
          "one side of the hand",
          overload->joint, overload->torque, payload_.mass * motion::kGravity, overload->most),
      scale_.object_load());
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
  const wrench::LoadEstimator before = scale_.knowledge();
  int recoveries;
  motion_->keep_posture(true);  // the camera looks from the present posture
  do {                          // a sensor rebooted in between has another residual
    recoveries = session_.recoveries();
    scale_.restore(before);
    scale_.begin_series();
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
    move_to(X_TH_start_, parameters_.travel_speed);
    tared_recoveries_ = session_.recoveries();
    scale_.tare(add_empty(parameters_.pose_time));
  } while (session_.recoveries() != recoveries);
  motion_->keep_posture(false);
  scale_.require_sound();
}

WristScale::MeanReading Manipulator::mean_reading(double seconds) {
  WristScale::Sampling sampling(scale_);
  seconds *= longer_;
  for_seconds(seconds, [&](double share) { sampling.add(share * seconds); });
  return sampling.mean();
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
    // A mean over a longer time is as good for a hand that is that much faster.
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
  if (lifting_) require_strength_for(route);
  for (const Eigen::Isometry3d& X_TV : route.way) {
    motion_->go_to(X_TV, bounds);
    while (!motion_->done()) cycle();
    if (motion_->status() != motion::HandMotion::Status::kReached) return false;
  }
  return true;
}

void Manipulator::retreat() {
  feeling_ = false;
  const auto go = [&](const Eigen::Isometry3d& X_TH) {
    try {
      move_to(X_TH, parameters_.travel_speed);
    } catch (const WayBlocked&) {
      return false;
    }
    return true;
  };
  for (auto pose = way_.rbegin(); pose != way_.rend(); ++pose) static_cast<void>(go(*pose));
  // A table may turn out to be in the way at the hand's start pose.
  for (const double higher : kHigher) {
    if (!go(raised(X_TH_start_, higher))) continue;
    if (higher == 0) return_to_start();
    return;
  }
}

/// Restoring the hand's pose alone would leave the torso leaning as in the last grasp, and from there a hand
/// may find no way to places it can reach from where the robot stood up.
void Manipulator::return_to_start() {
  motion_->return_to(q_start_);
  while (!motion_->done()) cycle();
}

void Manipulator::approach(const std::vector<Eigen::Isometry3d>& way) {
  session_.set_grip(0, kOpenTorque);
  feeling_ = true;
  p_TGrasp_.reset();
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
  scale_.begin_series();
  tared_recoveries_ = session_.recoveries();
  scale_.tare(add_empty(parameters_.tare_time));
}

Eigen::Isometry3d Manipulator::reference_for(const Eigen::Isometry3d& X_TH) const {
  return X_TH * session_.X_TH().inverse() * motion_->X_WH();
}

void Manipulator::descend(const Eigen::Isometry3d& X_TH) {
  const motion::MotionLimits slowly = limits(parameters_.approach_speed);
  p_TGrasp_ = X_TH.translation();
  if (!go_straight(reference_for(X_TH), slowly)) move_to(X_TH, slowly);
  feeling_ = false;  // the palm may touch the object now
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
  object_H_.min().x() = std::max(object_H.min().x(), -kFarthestEnd);
  object_H_.max().x() = std::min(object_H.max().x(), kFarthestEnd);
  p_HAxis_ = handle_axis(radius, parameters_);
  session_.set_holding(true);
  for_seconds(parameters_.close_time,
              [&](double share) { session_.set_grip(share, parameters_.grip_torque); });
  hold(parameters_.hold_time);
  if (session_.hand_closure() > parameters_.empty_closure) {
    throw Refused(fmt::format("the hand closed to {:.0f} % of its travel and holds nothing",
                              100 * session_.hand_closure()));
  }
  scale_.hold(radius, object_H_);
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
  for (const double turn : {-parameters_.weighing_turn, parameters_.weighing_turn}) {
    const Eigen::Isometry3d X_TH = turned_clear(about_handle(turn));
    const Route route = straight_route(*motion_, std::span(&X_TH, 1), carrying_limits());
    if (route.reach.status == motion::HandMotion::Status::kReached) require_strength_for(route);
  }
  double change = 0;
  while (true) {
    const double next = lifted_ + parameters_.lift_step;
    if (next > parameters_.lift_max + 1e-9) {
      throw HeldTooFar(fmt::format("lifted by {:.2f} m, the wrist carries {:.1f} N and {:.2f} N·m, which "
                                   "differs by {:.2f} N from the load {:.0f} cm lower, expected at most "
                                   "{:g} N: {}",
                                   lifted_, load.force.norm(), load.torque.norm(), change,
                                   100 * parameters_.lift_step, parameters_.lift_force_change, kNotFree),
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
        fmt::format("the wrist sensor weighs {:.2f} N after the lift: the object is not in the hand", force));
  }
  if (std::abs(force - payload_.mass * motion::kGravity) > parameters_.lift_force_change) carry(load);
  scale_.begin_weighing(load);
}

void Manipulator::carry(const Wrench& F_Ho_T) {
  const auto line = wrench::com_line(F_Ho_T, parameters_.min_force);
  if (!line) return;
  scale_.require_of_object(F_Ho_T);
  const Payload before = payload_;
  const Payload load{F_Ho_T.force.norm() / motion::kGravity,
                     session_.X_TH().linear().transpose() * line->p_PF};
  for_seconds(parameters_.payload_time, [&](double share) {
    payload_ = {(1 - share) * before.mass + share * load.mass, load.p_HCm};
    motion_->set_payload(payload_.mass, payload_.p_HCm);
  });
}

Wrench Manipulator::mean_object_load(double seconds) {
  wrench::WrenchAverage average;
  for_seconds(longer_ * seconds, [&](double) { average.add(scale_.object_load()); });
  return average.mean();
}

Eigen::Isometry3d Manipulator::turned_clear(const Eigen::Quaterniond& turn) const {
  const Eigen::Vector3d up_H = X_TH_grasp_.linear().transpose().col(2);
  // Lowest point, relative to Ho, of an object that has turned about the handle in the fingers.
  const auto lowest = [&](const Eigen::Quaterniond& hand, double in_hand) {
    const Eigen::Vector3d up = hand.inverse() * up_H;
    const Eigen::Array3d seen = (about_handle(in_hand).inverse() * up).array();
    const Eigen::Array3d low = (object_H_.min() - p_HAxis_).array(),
                         high = (object_H_.max() - p_HAxis_).array();
    return up.dot(p_HAxis_) + (seen * low).min(seen * high).sum();
  };
  // Torque of the weight about the handle: its sign is the direction in which it turns the object.
  const double torque = -payload_.mass * motion::kGravity * (payload_.p_HCm - p_HAxis_).cross(up_H).x();
  const double droop = std::min(std::abs(torque) / kSoftest, kFarthestTurned - kClosingTurn);
  const double from = std::min(0.0, std::copysign(droop, torque)) - kClosingTurn;
  const double to = std::max(0.0, std::copysign(droop, torque)) + kClosingTurn;
  double turned = lowest(turn, 0);
  double angle = from;
  while (angle < to + kTurnStep) {
    turned = std::min(turned, lowest(turn, std::min(angle, to)));
    angle += kTurnStep;
  }
  const double needed = lowest(Eigen::Quaterniond::Identity(), 0) - turned + kOverTable;
  Eigen::Isometry3d X_TH = raised(X_TH_grasp_, std::max(lifted_, needed));
  X_TH.rotate(turn);
  return X_TH;
}

void Manipulator::turn() {
  const Eigen::Isometry3d X_TH = raised(X_TH_grasp_, lifted_);
  for (const double turn : {-parameters_.weighing_turn, parameters_.weighing_turn}) {
    double angle = turn;
    Eigen::Isometry3d X_TH_turned = turned_clear(about_handle(angle));
    if (!go_straight(X_TH_turned, carrying_limits())) {
      angle = turn / 2;
      carry_to(X_TH_turned = turned_clear(about_handle(angle)));
    }
    weigh_turned(X_TH_turned, angle);
  }
  lifting_ = false;
  carry_to(X_TH);
  settle();
  turned_back_ = true;
}

/// The camera does not see an object's far underside, so one end may rest on something when the hand is
/// turned: the wrist then carries less, until the hand is higher.
void Manipulator::weigh_turned(const Eigen::Isometry3d& X_TH, double angle) {
  double expected = payload_.mass * motion::kGravity;
  double most =
      parameters_.lift_force_change + WristScale::kDeviations * scale_.turned_deviation(expected, angle);
  double higher = 0;
  while (true) {
    settle();
    const WristScale::MeanReading reading = mean_reading(parameters_.pose_time);
    const Wrench load = scale_.object_load(reading);
    const double force = load.force.norm();
    if (std::abs(force - expected) <= most) {
      scale_.add_loaded(reading);
      return;
    }
    higher += parameters_.lift_step;
    if (higher > parameters_.lift_max || !go_straight(raised(X_TH, higher), carrying_limits())) {
      throw HeldTooFar(
          fmt::format(
              "turned by {:.2f} rad, the wrist carries {:.1f} N and {:.2f} N·m, which differs by {:.2f} N "
              "from the expected load, expected at most {:.2f} N: {}",
              angle, force, load.torque.norm(), std::abs(force - expected), most, kNotFree),
          load);
    }
    expected = force;
    most = parameters_.lift_force_change;
  }
}

WristScale::MeanReading Manipulator::add_empty(double seconds) {
  settle();
  WristScale::MeanReading empty = mean_reading(seconds);
  scale_.add_empty(empty);
  return empty;
}

WristScale::Load Manipulator::weigh() {
  const WristScale::MeanReading level = mean_reading(parameters_.average_time);
  const bool turned_back = std::exchange(turned_back_, false);
  if (turned_back) scale_.compare(level);
  scale_.add_loaded(level);
  weighed_So_S_ = level.reading;
  weighed_ = scale_.weigh(level);
  if (turned_back) scale_.require_steady();
  scale_.require_same_bar(weighed_);
  return weighed_;
}

void Manipulator::hang() {
  const Eigen::Isometry3d X_HT = session_.X_TH().inverse();
  const Eigen::Vector3d& p_HCm = weighed_.p_HCm;
  const Eigen::Vector3d down_H = -X_HT.linear().col(2);
  const double most = parameters_.hanging_turn, most_roll = parameters_.hanging_roll;
  const double turn = std::remainder(std::atan2(down_H.z(), down_H.y()) - std::atan2(p_HCm.z(), p_HCm.y()),
                                     2 * std::numbers::pi);
  // From the handle's axis to the centre of mass, which points down once the hand has turned.
  const Eigen::Vector3d below_H(0, p_HCm.y(), p_HCm.z());
  const Eigen::Vector3d across_H = Eigen::Vector3d::UnitX().cross(below_H).normalized();
  // The object cannot be hung from a place farther off: a bar would have to be stood on its end.
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
  // Half of what would make a regrasp worthwhile.
  const double torque_change =
      parameters_.displacement_threshold / 2 * (weighed_.F_Ho_T.force.norm() + scale_.hand_weight());
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
  lifting_ = true;
  settle();
  const Wrench load = mean_object_load(parameters_.lift_window);
  carry(load);
  scale_.change_load();
  scale_.begin_weighing(load);
}

void Manipulator::check_residual() {
  if (session_.recoveries() != tared_recoveries_) return;  // a rebooted sensor has another residual
  settle();
  scale_.require_no_drift(mean_reading(parameters_.tare_time));
}

/// An object that has moved in the hand does not stand where it stood when the hand is back where it was.
void Manipulator::put_down() {
  // Upward force of the hand on the object, N: negative if the hand presses it onto the table.
  const auto lifting_force = [this](double seconds) { return -mean_object_load(seconds).force.z(); };
  // A load that was too much to be taken over has a weight, too: if it were ignored, the hand would press the
  // object onto the table.
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
  lifted_ = 0;
  put_down();
  Eigen::Isometry3d X_TH = session_.X_TH();
  // Without the load the hand rises to where it closed: a palm pressed onto a round object rolls it away.
  motion::MotionLimits rising = limits(parameters_.approach_speed);
  rising.duration = parameters_.close_time;
  motion_->go_to(X_TH_grasp_, rising);
  for_seconds(parameters_.close_time, [&](double share) {
    session_.set_grip(1 - share, parameters_.grip_torque);
    motion_->set_payload((1 - share) * payload_.mass, payload_.p_HCm);
  });
  session_.set_grip(0, kOpenTorque);
  hold(parameters_.hold_time);
  scale_.release();
  session_.set_holding(false);
  payload_ = {};
  ascend();
  return X_TH;
}

}  // namespace walkman::regrasp
