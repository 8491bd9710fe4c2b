// Sensors with errors drawn here: their readings come from their matrix, not from the code under test.

#include "adaptation/wrench/load_estimator.h"

#include <cmath>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace walkman::wrench {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double kWeight = 1.2 * 9.81;  // N, of the object and also of the hand
const Vector3d kHandCentre(0, 0.01, -0.12);
const Vector3d kLevel = Vector3d(-0.1, 1, -0.06).normalized();  // gravity in S, the hand over the object
const Vector3d kStart = Vector3d(-0.87, 0.27, -0.41).normalized();
constexpr double kAsIs = 0.0;
constexpr double kTilt = 0.007;  // rad, per axis: joint zeros and mounting of a calibrated robot

Vector3d about(const Vector3d& axis, double angle, const Vector3d& v) {
  return Eigen::AngleAxisd(angle, axis) * v;
}

Wrench hung(double weight, const Vector3d& p_SCm, const Vector3d& down_S) {
  return {p_SCm.cross(weight * down_S), weight * down_S};
}

/// Reads matrix * load + residual.
struct Sensor {
  Matrix6 matrix = Matrix6::Identity();
  Vector6 residual = Vector6::Zero();

  static Sensor drawn(std::mt19937& generator, double cross_talk) {
    const Vector6 range = (Vector6() << 1500, 1500, 2000, 35, 35, 25).finished();
    std::uniform_real_distribution<double> spread(-1, 1);
    Sensor sensor;
    for (int i = 0; i < 6; ++i) {
      for (int k = 0; k < 6; ++k) sensor.matrix(i, k) += spread(generator) * cross_talk * range[i] / range[k];
      sensor.residual[i] = spread(generator) * (i < 3 ? 2 : 0.05);
    }
    return sensor;
  }

  Wrench read(const Wrench& load) const {
    Vector6 stacked;
    stacked << load.force, load.torque;
    const Vector6 reading = matrix * stacked + residual;
    return {reading.tail<3>(), reading.head<3>()};
  }
};

/// A robot's wrist: the sensor's reading of the true hand and object, and the model's hand weight and gravity
/// direction.
struct Wrist {
  Sensor sensor;
  double hand_weight = kWeight;
  Matrix3d tilt = Matrix3d::Identity();  // from the model's gravity to the true one, in S
  LoadEstimator estimator{LoadEstimator::DataSheet{}};

  void empty(const Vector3d& down_S) {
    estimator.add_empty(sensor.read(hung(hand_weight, kHandCentre, tilt * down_S)), 200,
                        hung(kWeight, kHandCentre, down_S), down_S);
  }
  void loaded(const Vector3d& p_SCm, const Vector3d& down_S) {
    const Wrench hand = hung(hand_weight, kHandCentre, tilt * down_S);
    const Wrench object = hung(kWeight, p_SCm, tilt * down_S);
    estimator.add_loaded(sensor.read({hand.torque + object.torque, hand.force + object.force}), 200,
                         hung(kWeight, kHandCentre, down_S), down_S);
  }
  void calibrate() {
    estimator.begin_series();
    for (const double turn : {-0.7, 0.7, kAsIs}) empty(about(Vector3d::UnitZ(), turn, kStart));
  }
  LoadEstimator::Object weigh(const Vector3d& p_SCm) {
    estimator.begin_series();
    empty(kLevel);
    for (const double turn : {-0.25, 0.25, kAsIs}) loaded(p_SCm, about(Vector3d::UnitX(), turn, kLevel));
    return estimator.object();
  }
};

const Vector3d kAside(0.08, 0.04, -0.157);  // held 8 cm beside the centre of mass
const Vector3d kBelow(0, 0.04, -0.157);

TEST(LoadEstimator, APerfectSensorWeighsExactly) {
  Wrist wrist;
  wrist.sensor.residual << 1, -2, 0.5, 0.03, -0.02, 0.01;
  wrist.calibrate();
  const LoadEstimator::Object object = wrist.weigh(kAside);
  EXPECT_NEAR(object.weight, kWeight, 1e-3);
  EXPECT_LT((object.moment_S / object.weight - kAside).cross(kLevel).norm(), 1e-4);
  EXPECT_LT(object.misfit, 0.01);
}

// Sensors and hands drawn with the deviations assumed for the data sheet and the model: over many draws, the
// errors are as large as stated.
TEST(LoadEstimator, SaysHowSureItIs) {
  std::mt19937 generator(2);
  std::normal_distribution<double> normal;
  const LoadEstimator::DataSheet sheet;
  constexpr int kSensors = 300;
  double squares = 0;  // of torques about the hand, in units of their standard deviations
  for (int n = 0; n < kSensors; ++n) {
    Wrist wrist;
    for (int i = 0; i < 6; ++i) {
      for (int k = 0; k < 6; ++k) {
        const double deviation = i == k               ? sheet.gain
                                 : (i < 3) == (k < 3) ? sheet.cross_talk
                                 : i < 3              ? sheet.force_per_torque
                                                      : sheet.torque_per_force;
        wrist.sensor.matrix(i, k) += deviation * normal(generator);
      }
    }
    const Vector3d turn(normal(generator), normal(generator), normal(generator));
    wrist.tilt = Eigen::AngleAxisd(kTilt * turn.norm(), turn.normalized()).matrix();
    wrist.calibrate();
    const LoadEstimator::Object object = wrist.weigh(kAside);
    Eigen::Matrix<double, 2, 3> level;  // torques about horizontal axes, the only ones that weight causes
    level.row(0) = kLevel.unitOrthogonal();
    level.row(1) = kLevel.cross(kLevel.unitOrthogonal());
    Eigen::Matrix<double, 3, 4> slope;  // about the point where the hand holds, over weight and moment
    slope.col(0) = -kBelow.cross(kLevel);
    for (int i = 0; i < 3; ++i) slope.col(1 + i) = Vector3d::Unit(i).cross(kLevel);
    Eigen::Vector4d found;
    found << object.weight, object.moment_S;
    const Eigen::Vector2d error = level * (slope * found - (kAside - kBelow).cross(kWeight * kLevel));
    const Eigen::Matrix2d covariance =
        level * slope * object.covariance * slope.transpose() * level.transpose();
    squares += error.dot(covariance.inverse() * error);
  }
  // Two torques per sensor. Here the hand matches its model and hangs as its joints say, which the estimator
  // does not take for granted.
  EXPECT_LT(squares / (2 * kSensors), 1.2);
  EXPECT_GT(squares / (2 * kSensors), 0.5);
}

TEST(LoadEstimator, CrossTalkOfADataSheet) {
  std::mt19937 generator(1);
  constexpr int kSensors = 200;
  double by_difference = 0;
  double aside = 0;
  double below = 0;
  double along = 0;
  for (int n = 0; n < kSensors; ++n) {
    Wrist wrist;
    wrist.sensor = Sensor::drawn(generator, 0.01);
    wrist.calibrate();
    const LoadEstimator::Object first = wrist.weigh(kAside);
    wrist.sensor.residual += 0.3 * Vector6::Ones();  // drift between two grasps
    const LoadEstimator::Object second = wrist.weigh(kBelow);

    const Wrench hand = hung(kWeight, kHandCentre, kLevel);
    const Wrench object = hung(kWeight, kAside, kLevel);
    const Wrench both{hand.torque + object.torque, hand.force + object.force};
    by_difference +=
        std::pow((wrist.sensor.read(both).force - wrist.sensor.read(hand).force).dot(kLevel) - kWeight, 2);
    aside += std::pow(first.weight - kWeight, 2);
    below += std::pow(second.weight - kWeight, 2);
    along += std::pow(first.moment_S.x() / first.weight - kAside.x(), 2);
    EXPECT_LT(std::max(first.misfit, second.misfit), 1.5);
  }
  const auto rms = [](double squares) { return std::sqrt(squares / kSensors); };
  EXPECT_GT(rms(by_difference), 0.4);  // N
  EXPECT_LT(rms(aside), 0.25);
  EXPECT_LT(rms(below), 0.12);
  EXPECT_LT(rms(along), 0.002);  // m
}

/// The object in the hand shows where gravity points in the sensor: three orientations determine a tilt about
/// three axes.
TEST(LoadEstimator, ATiltOfTheSensorHardlyMatters) {
  Wrist upright, tilted;
  tilted.tilt = Eigen::AngleAxisd(0.012, Vector3d(1, 1, -1).normalized()).matrix();
  upright.calibrate();
  tilted.calibrate();
  const LoadEstimator::Object as_it_is = upright.weigh(kAside);
  const LoadEstimator::Object object = tilted.weigh(kAside);
  EXPECT_NEAR(object.weight, as_it_is.weight, 0.001 * kWeight);
  // Part of the tilt's effect on a weight 0.16 m from So, 1.9 mm.
  EXPECT_LT((object.moment_S / object.weight - kAside).cross(kLevel).norm(), 0.0005);
}

/// Maximum effect of a hand heavier than its model: the weight that the model lacks.
TEST(LoadEstimator, AnErrorOfTheHandsMassIsNotMagnified) {
  Wrist wrist;
  wrist.hand_weight = 1.02 * kWeight;
  wrist.calibrate();
  EXPECT_NEAR(wrist.weigh(kAside).weight, kWeight, 0.02 * kWeight);
}

TEST(LoadEstimator, ASensorThatIsNoneOfItsDataSheetContradictsItself) {
  Wrist sign;
  sign.sensor.matrix(3, 3) = -1;
  sign.calibrate();
  EXPECT_GT(sign.weigh(kAside).misfit, 2);

  Wrist swapped;
  swapped.sensor.matrix.row(1).swap(swapped.sensor.matrix.row(2));
  swapped.calibrate();
  EXPECT_GT(swapped.weigh(kAside).misfit, 2);

  Wrist gain;
  gain.sensor.matrix *= 1.3;
  gain.calibrate();
  EXPECT_GT(gain.weigh(kAside).misfit, 2);
}

// Off the plane according to readings of the object with 3 mm of deviation, known to be on it within 4 mm:
// the weighted mean of both goes 9/25 of the way back (two normal distributions).
TEST(NearPlane, IsTheWeightedMeanOfReadingsAndOfWhatIsKnown) {
  const Vector3d n = Vector3d(1, 2, 2) / 3;
  constexpr double kOffset = -0.12, kOff = 0.005, kRead = 0.003, kKnown = 0.004;
  LoadEstimator::Object object;
  object.weight = 10;
  object.moment_S = object.weight * ((kOffset + kOff) * n + 0.3 * Vector3d(0, 1, -1));
  object.covariance.diagonal() << 0, Vector3d::Constant(std::pow(object.weight * kRead, 2));
  const LoadEstimator::Object known = near_plane(object, n, kOffset, kKnown, 2);
  EXPECT_DOUBLE_EQ(known.weight, 10);
  const Vector3d moved = (known.moment_S - object.moment_S) / object.weight;
  EXPECT_LT((moved + kOff * 9 / 25 * n).norm(), 1e-12);
  const Matrix3d covariance = known.covariance.bottomRightCorner<3, 3>();
  EXPECT_NEAR(std::sqrt(n.dot(covariance * n)) / object.weight, kRead * kKnown / 0.005, 1e-12);
  const Vector3d along = n.unitOrthogonal();
  EXPECT_NEAR(std::sqrt(along.dot(covariance * along)) / object.weight, kRead, 1e-12);
}

TEST(NearPlane, WhatContradictsIsAsRead) {
  LoadEstimator::Object object;
  object.weight = 10;
  object.covariance.diagonal() << 0, Vector3d::Constant(std::pow(object.weight * 0.003, 2));
  for (const double off : {0.0099, 0.0101}) {  // two deviations of 5 mm
    object.moment_S = object.weight * off * Vector3d::UnitZ();
    const double moved =
        near_plane(object, Vector3d::UnitZ(), 0, 0.004, 2).moment_S.z() - object.moment_S.z();
    EXPECT_EQ(moved != 0, off < 0.01) << off;
  }
}

}  // namespace
}  // namespace walkman::wrench
