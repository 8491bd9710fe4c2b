#pragma once

#include <vector>

#include <Eigen/Core>

#include "urdf/reader/wrench.h"

namespace walkman::wrench {

/// Estimates the load in a hand from the readings of a force/torque sensor that has cross-talk, gain errors
/// and residuals.
///
/// The sensor S is modelled as reading (1 + E) load + residual, with the load being the hand's weight plus
/// the object's. The hand's weight is known from the model, up to an error of its mass and centre of mass,
/// and so is the direction of gravity in S, up to a tilt due to joint zeros and mountings: readings with the
/// empty hand in several orientations determine E and the tilt; the same object in several orientations can
/// be told apart from their effects. All unknowns are estimated together, by least squares over the readings
/// (Gauss-Newton: E times load is a product of two unknowns, and so is the rotation of a weight), with the
/// data sheet as the prior of E, and what is known of E is kept from one series of readings to the next. The
/// residual is not: it drifts, and is different after the sensor reboots.
class LoadEstimator {
 public:
  struct DataSheet {
    // Standard deviations of E's entries, for a sensor that was calibrated and mounted with care.
    double gain = 0.015;             ///< of an axis
    double axial_gain = 0.007;       ///< of the force along z
    double cross_talk = 0.01;        ///< from one force to another, or one torque to another
    double force_per_torque = 0.3;   ///< 1/m
    double torque_per_force = 5e-4;  ///< m; includes the position of its origin
    double force_range = 1500;       ///< N
    double torque_range = 35;        ///< N·m
    double force_noise = 0.25;       ///< N, standard deviation of a reading
    double torque_noise = 0.005;     ///< N·m
    /// Of the hand's hold, N/m: when the hand is turned, the object's own weight moves it in the hand.
    double grasp_stiffness = 5000;
  };

  explicit LoadEstimator(const DataSheet& sheet);

  /// Starts a series: with a new residual, and nothing in the hand.
  void begin_series();

  /// Adds the mean of `count` readings at rest, and the weight of the hand in that posture from the model;
  /// both about So in S. `down_S`: unit vector of gravity.
  void add_empty(const Wrench& reading_So_S, int count, const Wrench& hand_So_S,
                 const Eigen::Vector3d& down_S);
  /// The same with the object in the hand, where it must not slip during a series.
  void add_loaded(const Wrench& reading_So_S, int count, const Wrench& hand_So_S,
                  const Eigen::Vector3d& down_S);

  /// Call when the hand holds another object from now on: discards the readings with the previous one.
  void change_load();

  struct Object {
    double weight = 0;  ///< N
    /// Weight times the centre of mass relative to So, N·m.
    Eigen::Vector3d moment_S = Eigen::Vector3d::Zero();
    /// Deviation of readings and data sheet from the fit: root of the sum of squares per value read, in
    /// standard deviations. At most about 1 if the sensor is as in its data sheet.
    double misfit = 0;
    /// Of weight (N) and moment (N·m), from data sheet, model and readings.
    Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  };
  /// Returns the object of this series; needs readings with and without it.
  [[nodiscard]] Object object() const;

 private:
  struct Reading {
    Wrench reading, hand;
    Eigen::Vector3d down_S;
    int count;
    bool loaded;
  };
  struct Fit {
    Eigen::VectorXd unknowns;
    Eigen::MatrixXd information;
    Eigen::VectorXd weighted;
    double misfit = 0;
  };
  [[nodiscard]] Fit fit() const;
  [[nodiscard]] Eigen::Vector3d mean_down() const;
  [[nodiscard]] Eigen::Vector3d hand_centre() const;
  [[nodiscard]] Eigen::Vector3d swing_of(double weight, const Eigen::Vector3d& level_S,
                                         const Eigen::Vector3d& down_S) const;

  DataSheet sheet_;
  // Unknowns kept from series to series: E by rows, the hand's relative mass error, the error of its centre
  // of mass, the tilt. Information matrix, and its product with the mean.
  Eigen::VectorXd deviation_;  // standard deviations before any reading
  Eigen::MatrixXd information_;
  Eigen::VectorXd weighted_;
  std::vector<Reading> series_;
};

/// Returns the object given that its centre of mass lies near the plane n·p = `offset` (m) in S, with
/// standard deviation `deviation` (m): the weighted mean of both. Returns it unchanged if they differ by more
/// than `contradiction` of their combined standard deviations.
[[nodiscard]] LoadEstimator::Object near_plane(LoadEstimator::Object object, const Eigen::Vector3d& n_S,
                                               double offset, double deviation, double contradiction);

}  // namespace walkman::wrench
