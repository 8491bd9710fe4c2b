#include "adaptation/regrasp/wrist_scale.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "adaptation/motion/grip.h"

namespace walkman::regrasp {
namespace {

constexpr double kMostMisfit = 2;  // sensors within their data sheet reach 0.9, at worst 1.5
// Mounting error of the hand on its sensor: the screws of both have 0.2 mm of clearance on 45 mm.
constexpr double kMountingTurn = 0.005;     // rad
constexpr double kMountingOrigin = 0.0006;  // m
// For a bar: its largest extent from its handle's axis, in radii; the accuracy with which its radius is seen;
// and its straightness: a tube bends by at most 0.2 % of its length (EN 10219-2), which moves the centre of
// mass a third of that off the axis at its middle.
constexpr double kBar = 2;
constexpr double kRadiusError = 0.001;  // m
constexpr double kBend = 0.002 / 3;     // of its length
constexpr double kAxisError = 0.003;    // m, of its axis in the hand: how it is seated, from grasp to grasp
// m, by which the pads let an object settle when the hand turns to either side: with 12 N, 2.5 mm at most in
// 220 lifts; 2.1 mm with 40 N.
constexpr double kSettling = 0.0035;
// Cosine of the largest angle between a load and the vertical: an end that still rests on the table pulls
// sideways by its friction, with a coefficient of 1 up to as much as the hand then carries.
constexpr double kSteepest = 0.7071;
constexpr double kDensest = 7850;  // kg/m³, steel

wrench::LoadEstimator::DataSheet sensor_of(const StageTwoParameters& parameters) {
  return {.gain = parameters.sensor_gain,
          .axial_gain = parameters.sensor_axial_gain,
          .cross_talk = parameters.sensor_cross_talk,
          .force_per_torque = parameters.sensor_force_per_torque,
          .torque_per_force = parameters.sensor_torque_per_force,
          .force_range = parameters.sensor_force_range,
          .torque_range = parameters.sensor_torque_range};
}

}  // namespace

WristScale::WristScale(const KnownRobot& known, const Session& session, const StageTwoParameters& parameters)
    : known_(known),
      session_(session),
      parameters_(parameters),
      hand_weight_(known.model, session.hand().force_torque),
      estimator_(sensor_of(parameters)) {}

void WristScale::Sampling::add(double time) {
  const Session& session = scale_.session_;
  reading_.add(session.F_So_S());
  trend_.add(time, session.F_So_S());
  hand_.add(scale_.hand_weight_.F_So_S(session.measured()));
  down_S_ -= session.X_TS().linear().transpose().col(2);
}

WristScale::MeanReading WristScale::Sampling::mean() const {
  return {reading_.mean(), hand_.mean(), trend_.slope(), down_S_.normalized(), reading_.count()};
}

void WristScale::change_hand() {
  hand_weight_ = wrench::HandWeight(known_.model, session_.hand().force_torque);
  estimator_ = wrench::LoadEstimator(sensor_of(parameters_));
  drift_So_S_ = {};
}

void WristScale::add_empty(const MeanReading& reading) {
  estimator_.add_empty(reading.reading, reading.count, reading.hand, reading.down_S);
}

void WristScale::add_loaded(const MeanReading& reading) {
  estimator_.add_loaded(reading.reading, reading.count, reading.hand, reading.down_S);
}

void WristScale::tare(const MeanReading& empty) {
  residual_So_S_ = {empty.reading.torque - empty.hand.torque, empty.reading.force - empty.hand.force};
}

void WristScale::require_sound() const {
  const double misfit = estimator_.object().misfit;
  if (misfit < kMostMisfit) return;
  throw Refused(
      fmt::format("the wrist sensor's readings of the empty hand contradict its weight: in four orientations "
                  "they deviate by {:.1f} standard deviations, expected less than {:g}: the sensor is faulty",
                  misfit, kMostMisfit));
}

void WristScale::require_no_drift(const MeanReading& empty) {
  drift_So_S_ = {empty.reading.torque - empty.hand.torque - residual_So_S_.torque,
                 empty.reading.force - empty.hand.force - residual_So_S_.force};
  const double force = drift_So_S_.force.norm(), torque = drift_So_S_.torque.norm();
  if (force <= parameters_.force_drift && torque <= parameters_.torque_drift) return;
  throw Refused(fmt::format(
      "the wrist sensor's residual differs by {:.2f} N and {:.3f} N·m from that before the grasp, expected "
      "at most {:g} and {:g}: it drifts, so its weighing cannot be trusted",
      force, torque, parameters_.force_drift, parameters_.torque_drift));
}

void WristScale::hold(double radius, const Eigen::AlignedBox3d& object_H) {
  object_H_ = object_H;
  bar_radius_.reset();
  const Eigen::Vector3d p_HAxis = handle_axis(radius, parameters_);
  const double farthest = std::max((p_HAxis - object_H.min()).tail<2>().maxCoeff(),
                                   (object_H.max() - p_HAxis).tail<2>().maxCoeff());
  if (farthest < kBar * radius) bar_radius_ = radius;
  const HandParts& hand = session_.hand();
  hand_weight_.hold(hand.frame, motion::Grip(known_.model, hand.frame, hand.motor).around(radius));
}

void WristScale::release() { hand_weight_.hold(session_.hand().frame, {}); }

void WristScale::begin_weighing(const Wrench& F_Ho_T) {
  lifted_Ho_T_ = F_Ho_T;
  change_.setZero();
}

void WristScale::compare(const MeanReading& level) {
  change_ = object_load(level).torque - lifted_Ho_T_.torque;
}

void WristScale::require_steady() const {
  if (change_.norm() <= most_change()) return;
  throw HeldTooFar(
      fmt::format(
          "back in the same pose, the wrist's torque differs by {:.3f} N·m from that before the hand turned, "
          "expected at most {:.3f}: the sensor drifts, or the object slips in the hand",
          change_.norm(), most_change()),
      lifted_Ho_T_);
}

double WristScale::most_change() const {
  return std::max(parameters_.torque_drift, kSettling * lifted_Ho_T_.force.norm());
}

Wrench WristScale::object_load() const {
  MeanReading now;
  now.reading = session_.F_So_S();
  now.hand = hand_weight_.F_So_S(session_.measured());
  return object_load(now);
}

Wrench WristScale::object_load(const MeanReading& reading) const {
  const Eigen::Isometry3d& X_TS = session_.X_TS();
  const Wrench F_So_T{X_TS.linear() * (reading.reading.torque - residual_So_S_.torque - reading.hand.torque),
                      X_TS.linear() * (reading.reading.force - residual_So_S_.force - reading.hand.force)};
  return wrench::shift(F_So_T, session_.X_TH().translation() - X_TS.translation());
}

wrench::LoadEstimator::Object WristScale::object() const {
  wrench::LoadEstimator::Object object = estimator_.object();
  const Eigen::Isometry3d X_HS = session_.X_TH().inverse() * session_.X_TS();
  const double mounting = std::hypot(kMountingTurn * X_HS.translation().norm(), kMountingOrigin);
  object.covariance.diagonal().tail<3>().array() +=
      std::pow(object.weight * mounting, 2) + drift_So_S_.torque.squaredNorm() / 3;
  object.covariance(0, 0) += drift_So_S_.force.squaredNorm() / 3;
  const double along = X_HS.linear().row(0).dot(object.moment_S) / object.weight + X_HS.translation().x();
  if (!bar_radius_ || std::abs(along) > parameters_.displacement_threshold) return object;
  const Eigen::Vector4d errors(motion::Grip::kSeatDeviation,
                               motion::Grip::seat(0) - motion::Grip::seat(kRadiusError),
                               object.weight / motion::Grip::kFirmness, kBend * object_H_.sizes().x());
  return wrench::near_plane(std::move(object), X_HS.linear().row(2).transpose(),
                            motion::Grip::seat(*bar_radius_) - X_HS.translation().z(), errors.norm(),
                            kDeviations);
}

void WristScale::require_in_range(const Wrench& F_So_S, const Wrench& load) const {
  const double force = F_So_S.force.lpNorm<Eigen::Infinity>();
  const double torque = F_So_S.torque.lpNorm<Eigen::Infinity>();
  if (force <= parameters_.sensor_force_range && torque <= parameters_.sensor_torque_range) return;
  throw HeldTooFar(
      fmt::format("the wrist's sensor reads {:.1f} N and {:.2f} N·m on an axis, expected at "
                  "most its range of {:g} N and {:g} N·m",
                  force, torque, parameters_.sensor_force_range, parameters_.sensor_torque_range),
      load);
}

WristScale::Load WristScale::weigh(const MeanReading& level) const {
  const Wrench load = object_load(level);
  require_in_range(level.reading, load);
  if (level.slope.force.norm() > parameters_.force_slope ||
      level.slope.torque.norm() > parameters_.torque_slope) {
    throw HeldTooFar(fmt::format("the wrist sensor's reading is not steady: it changes by {:.2f} N and "
                                 "{:.3f} N·m per second while the object hangs still, expected less than "
                                 "{:g} and {:g}: the sensor drifts, or the object slips",
                                 level.slope.force.norm(), level.slope.torque.norm(), parameters_.force_slope,
                                 parameters_.torque_slope),
                     load);
  }
  const wrench::LoadEstimator::Object object = this->object();
  if (!(object.misfit < kMostMisfit)) {
    throw HeldTooFar(
        fmt::format("the wrist sensor's readings contradict each other: under {:.1f} N and {:.2f} N·m, with "
                    "the hand turned, they deviate by {:.1f} standard deviations from those of any "
                    "single object, expected less than {:g}: the sensor is faulty, or the object turns in "
                    "the hand",
                    load.force.norm(), load.torque.norm(), object.misfit, kMostMisfit),
        load);
  }
  const Eigen::Isometry3d &X_TS = session_.X_TS(), &X_TH = session_.X_TH();
  const Eigen::Vector3d down_T = -Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d p_SoHo_T = X_TH.translation() - X_TS.translation();
  Eigen::Matrix4d slope = Eigen::Matrix4d::Zero();  // with respect to weight and moment
  slope.topLeftCorner<3, 1>() = -p_SoHo_T.cross(down_T);
  for (int i = 0; i < 3; ++i) slope.block<3, 1>(0, 1 + i) = X_TS.linear().col(i).cross(down_T);
  slope(3, 0) = 1;
  return {wrench::shift({(X_TS.linear() * object.moment_S).cross(down_T), object.weight * down_T}, p_SoHo_T),
          slope * object.covariance * slope.transpose(),
          X_TH.inverse() * (X_TS * Eigen::Vector3d(object.moment_S / object.weight))};
}

void WristScale::require_same_bar(const Load& load) {
  if (!bar_radius_) {
    weighed_bar_.reset();
    return;
  }
  const double weight = load.F_Ho_T.force.norm();
  const Eigen::Vector3d p_AxisCm = load.p_HCm - handle_axis(*bar_radius_, parameters_);
  const double torque = std::sqrt(load.covariance.topLeftCorner<3, 3>().trace());
  const WeighedBar now{weight, std::sqrt(load.covariance(3, 3)), p_AxisCm.tail<2>().norm(), torque / weight};
  const std::optional<WeighedBar> before = std::exchange(weighed_bar_, now);
  if (!before || std::abs(before->weight - weight) >
                     kDeviations * std::hypot(before->weight_deviation, now.weight_deviation))
    return;
  const double bound = kAxisError + kDeviations * std::hypot(before->offset_deviation, now.offset_deviation);
  if (std::abs(before->offset - now.offset) <= bound) return;
  throw Refused(fmt::format(
      "by the wrist, the centre of mass is {:.0f} mm from the bar's axis, and was {:.0f} mm from it when the "
      "bar was weighed before, expected a difference of at most {:.0f} mm: the sensor's readings are off, or "
      "the bar slips in the hand, or something on it has moved",
      1e3 * now.offset, 1e3 * before->offset, 1e3 * bound));
}

void WristScale::require_of_object(const Wrench& F_Ho_T) const {
  // Gains of force and torque, each by the data sheet, over the lever from the sensor.
  const double lever = (session_.X_TH().translation() - session_.X_TS().translation()).norm();
  require_of_object(F_Ho_T, std::numbers::sqrt2 * parameters_.sensor_gain * lever * F_Ho_T.force.norm());
}

void WristScale::require_of_object(const Wrench& F_Ho_T, double torque_deviation) const {
  const auto line = wrench::com_line(F_Ho_T, parameters_.min_force);
  if (!line) return;
  require_in_range(session_.F_So_S(), F_Ho_T);
  const double force = F_Ho_T.force.norm(), torque = F_Ho_T.torque.norm();
  if (!(-F_Ho_T.force.z() >= kSteepest * force)) {
    throw Refused(fmt::format(
        "the {:.1f} N at the wrist pull the hand {:.0f} degrees off the vertical, expected at most 45: no "
        "weight hanging there could cause these readings",
        force, std::acos(-F_Ho_T.force.z() / force) * 180 / std::numbers::pi));
  }
  const double heaviest = kDensest * object_H_.volume() * motion::kGravity;
  if (!(force <= heaviest)) {
    throw Refused(fmt::format(
        "according to the wrist sensor the object weighs {:.1f} N, expected at most {:.1f} N, the weight of "
        "solid steel of the size seen: no object hanging there could cause these readings",
        force, heaviest));
  }
  const Eigen::Matrix3d R_HT = session_.X_TH().linear().transpose();
  const double beside = wrench::distance_of({R_HT * line->p_PF, R_HT * line->direction}, object_H_);
  const double bound = parameters_.displacement_threshold + kDeviations * torque_deviation / force;
  if (beside <= bound) return;
  throw Refused(fmt::format(
      "by the {:.1f} N and {:.2f} N·m at the wrist, the centre of mass would be {:.0f} mm outside of the "
      "object seen, expected at most {:.0f} mm: no weight hanging there could cause these readings",
      force, torque, 1e3 * beside, 1e3 * bound));
}

double WristScale::turned_deviation(double weight, double angle) const {
  return (weight + hand_weight()) * std::sin(std::abs(angle)) *
         std::hypot(parameters_.sensor_gain, parameters_.sensor_cross_talk);
}

}  // namespace walkman::regrasp
