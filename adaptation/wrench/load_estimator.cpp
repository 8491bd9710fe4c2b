#include "adaptation/wrench/load_estimator.h"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

namespace walkman::wrench {
namespace {

using Eigen::Matrix3d, Eigen::MatrixXd, Eigen::Vector3d, Eigen::VectorXd;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

// Indices of the unknowns. The last two groups belong to a series.
constexpr int kCrossTalk = 0;           // 36, by rows
constexpr int kHandMass = 36;           // relative error of the mass
constexpr int kHandCentre = 37;         // 3, m
constexpr int kTilt = 40;               // 3, rad: rotation of gravity in S from the model's
constexpr int kStaying = 43;            // all of the above
constexpr int kResidual = kStaying;     // 6
constexpr int kWeight = kResidual + 6;  // N
constexpr int kMoment = kWeight + 1;    // 3, N·m
constexpr int kUnknowns = kMoment + 3;

// How well a calibrated robot knows the load of its empty hand.
constexpr double kMassError = 0.017;    // 20 g of 1.2 kg: cables
constexpr double kCentreError = 0.003;  // m
constexpr double kDownError = 0.002;    // rad between two postures: joint zeros of 2.5 mrad
// rad, per axis, common to all postures: a third of the squares of ten joint zeros of 2.5 mrad, and the
// mountings of the sensor (3.5 mrad, one in seven 10 to 17) and of the inertial unit (2.6 mrad, one in seven
// 8 to 13).
constexpr double kTiltError = 0.007;
constexpr double kResidualError = 0.1;  // fraction of the range: hardly any information
constexpr double kMostWeight = 1e4;     // N, and N·m: hardly any information
constexpr int kIterations = 4;          // E is small, so even the second one changes little

Matrix3d cross(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Vector6 stacked(const Wrench& wrench) {
  Vector6 out;
  out << wrench.force, wrench.torque;
  return out;
}

Matrix6 cross_talk(const VectorXd& unknowns) {
  Matrix6 E;
  for (int i = 0; i < 6; ++i) E.row(i) = unknowns.segment<6>(kCrossTalk + 6 * i).transpose();
  return E;
}

/// Derivative of the load of a weight and moment with respect to the rotation of gravity in S, per rad.
Eigen::Matrix<double, 6, 3> turning(double weight, const Vector3d& moment_S, const Vector3d& down_S) {
  Eigen::Matrix<double, 6, 3> out;
  out << -weight * cross(down_S), -cross(moment_S) * cross(down_S);
  return out;
}

/// Derivative of the load with respect to weight and moment.
Eigen::Matrix<double, 6, 4> hanging(const Vector3d& down_S) {
  Eigen::Matrix<double, 6, 4> out = Eigen::Matrix<double, 6, 4>::Zero();
  out.topLeftCorner<3, 1>() = down_S;
  out.bottomRightCorner<3, 3>() = -cross(down_S);
  return out;
}

}  // namespace

LoadEstimator::LoadEstimator(const DataSheet& sheet) : sheet_(sheet), deviation_(kStaying) {
  Matrix6 E;
  E << Matrix3d::Constant(sheet.cross_talk), Matrix3d::Constant(sheet.force_per_torque),
      Matrix3d::Constant(sheet.torque_per_force), Matrix3d::Constant(sheet.cross_talk);
  E.diagonal().setConstant(sheet.gain);
  E(2, 2) = sheet.axial_gain;
  for (int i = 0; i < 6; ++i) deviation_.segment<6>(kCrossTalk + 6 * i) = E.row(i).transpose();
  deviation_[kHandMass] = kMassError;
  deviation_.segment<3>(kHandCentre).setConstant(kCentreError);
  deviation_.segment<3>(kTilt).setConstant(kTiltError);
  information_ = deviation_.cwiseAbs2().cwiseInverse().asDiagonal();
  weighted_ = VectorXd::Zero(kStaying);
}

void LoadEstimator::begin_series() {
  if (!series_.empty()) {
    // Information from the series on the lasting unknowns: its own are eliminated.
    const Fit last = fit();
    constexpr int kOwn = kUnknowns - kStaying;
    const MatrixXd gain = last.information.bottomRightCorner(kOwn, kOwn)
                              .ldlt()
                              .solve(last.information.bottomLeftCorner(kOwn, kStaying))
                              .transpose();
    information_ = last.information.topLeftCorner(kStaying, kStaying) -
                   gain * last.information.bottomLeftCorner(kOwn, kStaying);
    weighted_ = last.weighted.head(kStaying) - gain * last.weighted.tail(kOwn);
  }
  series_.clear();
}

void LoadEstimator::add_empty(const Wrench& reading_So_S, int count, const Wrench& hand_So_S,
                              const Vector3d& down_S) {
  series_.push_back({reading_So_S, hand_So_S, down_S, count, false});
}

void LoadEstimator::add_loaded(const Wrench& reading_So_S, int count, const Wrench& hand_So_S,
                               const Vector3d& down_S) {
  series_.push_back({reading_So_S, hand_So_S, down_S, count, true});
}

void LoadEstimator::change_load() {
  std::erase_if(series_, [](const Reading& reading) { return reading.loaded; });
}

/// Mean over the readings with the object.
Vector3d LoadEstimator::mean_down() const {
  Vector3d sum = Vector3d::Zero();
  int count = 0;
  for (const Reading& r : series_) {
    if (!r.loaded) continue;
    sum += r.down_S;
    ++count;
  }
  return count > 0 ? Vector3d(sum / count) : sum;
}

/// Centre of mass of the hand from the model, m from So: the best fit over the series' postures.
Vector3d LoadEstimator::hand_centre() const {
  Matrix3d squares = Matrix3d::Zero();
  Vector3d products = Vector3d::Zero();
  for (const Reading& r : series_) {
    const Matrix3d lever = -cross(r.hand.force);
    squares += lever.transpose() * lever;
    products += lever.transpose() * r.hand.torque;
  }
  return squares.completeOrthogonalDecomposition().solve(products);
}

/// Deviation of the torque, N·m per axis, if an object yields in the hand in the direction in which its
/// weight has turned.
Vector3d LoadEstimator::swing_of(double weight, const Vector3d& level_S, const Vector3d& down_S) const {
  const Vector3d turn = level_S.cross(down_S);
  if (turn.norm() < 1e-9) return Vector3d::Zero();
  const double give = weight * (down_S - level_S).norm() / sheet_.grasp_stiffness;  // m
  return weight * give * turn.normalized();
}

LoadEstimator::Fit LoadEstimator::fit() const {
  Fit out;
  out.unknowns = VectorXd::Zero(kUnknowns);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    out.information = MatrixXd::Zero(kUnknowns, kUnknowns);
    out.information.topLeftCorner(kStaying, kStaying) = information_;
    for (int i = 0; i < 6; ++i) {
      const double deviation = kResidualError * (i < 3 ? sheet_.force_range : sheet_.torque_range);
      out.information(kResidual + i, kResidual + i) = 1 / (deviation * deviation);
    }
    out.information.bottomRightCorner<4, 4>().diagonal().setConstant(1 / (kMostWeight * kMostWeight));
    out.weighted = VectorXd::Zero(kUnknowns);
    out.weighted.head(kStaying) = weighted_;
    const Matrix6 E = cross_talk(out.unknowns);
    const double weight = out.unknowns[kWeight];
    const Vector3d level = mean_down();
    const Vector3d hand_centre = this->hand_centre();
    const Vector3d tilt = out.unknowns.segment<3>(kTilt);
    double squares = 0;
    for (const Reading& r : series_) {
      const Vector3d down = r.down_S + tilt.cross(r.down_S);
      Eigen::Matrix<double, 6, kUnknowns> slope = Eigen::Matrix<double, 6, kUnknowns>::Zero();
      const double hand_weight = r.hand.force.norm();
      slope.middleCols<3>(kTilt) = turning(hand_weight, hand_weight * hand_centre, r.down_S);
      Vector6 load = stacked(r.hand) + slope.middleCols<3>(kTilt) * tilt;
      slope.col(kHandMass) = load;
      slope.block<3, 3>(3, kHandCentre) = -hand_weight * cross(down);
      load += slope.middleCols<4>(kHandMass) * out.unknowns.segment<4>(kHandMass);
      if (r.loaded) {
        slope.middleCols<4>(kWeight) = hanging(down);
        slope.middleCols<3>(kTilt) += turning(weight, out.unknowns.segment<3>(kMoment), r.down_S);
        load += slope.middleCols<4>(kWeight) * out.unknowns.segment<4>(kWeight);
      }
      // d((1 + E) load) = dE load + (1 + E) d(load)
      slope += (E * slope).eval();
      for (int i = 0; i < 6; ++i) slope.block<1, 6>(i, kCrossTalk + 6 * i) = load.transpose();
      slope.middleCols<6>(kResidual).setIdentity();
      const Vector6 model = load + E * load + out.unknowns.segment<6>(kResidual);
      const Vector6 ahead = stacked(r.reading) - model + slope * out.unknowns;
      const double force = load.head<3>().norm() * kDownError;
      const double torque = load.tail<3>().norm() * kDownError;
      const Vector3d swing = r.loaded ? swing_of(weight, level, r.down_S) : Vector3d(Vector3d::Zero());
      for (int i = 0; i < 6; ++i) {
        const double noise = i < 3 ? sheet_.force_noise : sheet_.torque_noise;
        const double posture = i < 3 ? force : std::hypot(torque, swing[i - 3]);
        const double information = 1 / (noise * noise / r.count + posture * posture);
        out.information += information * slope.row(i).transpose() * slope.row(i);
        out.weighted += information * slope.row(i).transpose() * ahead[i];
        squares += information * std::pow(stacked(r.reading)[i] - model[i], 2);
      }
    }
    squares += out.unknowns.head(kStaying).cwiseQuotient(deviation_).squaredNorm();
    out.misfit = std::sqrt(squares / static_cast<double>(6 * series_.size()));
    out.unknowns = out.information.ldlt().solve(out.weighted);
  }
  return out;
}

LoadEstimator::Object LoadEstimator::object() const {
  const Fit fit = this->fit();
  const MatrixXd own = MatrixXd::Identity(kUnknowns, kUnknowns).rightCols<4>();
  return {fit.unknowns[kWeight], fit.unknowns.segment<3>(kMoment), fit.misfit,
          fit.information.ldlt().solve(own).bottomRows<4>()};
}

LoadEstimator::Object near_plane(LoadEstimator::Object object, const Vector3d& n_S, double offset,
                                 double deviation, double contradiction) {
  Eigen::Vector4d slope;  // gradient of the weight times the distance from the plane
  slope << -offset, n_S;
  const double off = n_S.dot(object.moment_S) - offset * object.weight;
  const Eigen::Vector4d shared = object.covariance * slope;
  const double variance = slope.dot(shared) + std::pow(object.weight * deviation, 2);
  if (std::abs(off) > contradiction * std::sqrt(variance)) return object;
  const Eigen::Vector4d change = -off / variance * shared;
  object.weight += change[0];
  object.moment_S += change.tail<3>();
  object.covariance -= shared * shared.transpose() / variance;
  return object;
}

}  // namespace walkman::wrench
