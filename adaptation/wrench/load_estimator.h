#pragma once

#include <vector>

#include <Eigen/Core>

#include "urdf/reader/wrench.h"

namespace walkman::wrench {

/// Weighs what hangs in a hand by readings of a force/torque sensor that has cross-talk, gain errors and
/// residuals.
///
/// The sensor S is taken to read (1 + E) load + residual, the load to be the hand's weight and the object's.
/// The hand's is known from the model, within an error of its mass and centre of mass, and so is where
/// gravity points in S, within the tilt that joints' zeros and mountings make: readings with the empty hand
/// in several orientations tell E and tilt; the same object in several orientations tells it apart from what
/// they make of it. All unknowns are found together, by least squares over the readings (Gauss-Newton: E
/// times load is a product of two, and so is a weight's turn), with the data sheet as the prior of E, and
/// what is known of E is kept from one series of readings to the next. The residual is not: it drifts, and a
/// sensor that booted anew has another.
class LoadEstimator {
 public:
  struct DataSheet {
    // Standard deviations of E's entries, of a sensor that was calibrated and mounted with care.
    double gain = 0.015;             ///< of an axis
    double axial_gain = 0.007;       ///< of the force along z
    double cross_talk = 0.01;        ///< of a force on another, of a torque on another
    double force_per_torque = 0.3;   ///< 1/m
    double torque_per_force = 5e-4;  ///< m; its origin's place, too
    double force_range = 1500;       ///< N
    double torque_range = 35;        ///< N·m
    double force_noise = 0.25;       ///< N, standard deviation of a reading
    double torque_noise = 0.005;     ///< N·m
    /// With which the hand holds an object, N/m: its own weight moves it in the hand when the hand is turned.
    double grasp_stiffness = 5000;
  };

  explicit LoadEstimator(const DataSheet& sheet);

  /// A new residual, and nothing in the hand.
  void begin_series();

  /// Mean of so many readings at rest, and the weight of the hand at that posture by the model; about So in
  /// S. `down_S`: unit vector of gravity.
  void add_empty(const Wrench& reading_So_S, int count, const Wrench& hand_So_S,
                 const Eigen::Vector3d& down_S);
  /// The same with the object in the hand, in which it must not slip during a series.
  void add_loaded(const Wrench& reading_So_S, int count, const Wrench& hand_So_S,
                  const Eigen::Vector3d& down_S);

  /// What is in the hand is another object from now on: readings with the last one go.
  void change_load();

  struct Object {
    double weight = 0;  ///< N
    /// Weight times the centre of mass seen from So, N·m.
    Eigen::Vector3d moment_S = Eigen::Vector3d::Zero();
    /// How far readings and data sheet are from what the fit makes of them: root of the sum of squares per
    /// value read, in their standard deviations. About 1 at most when the sensor is what its data sheet says.
    double misfit = 0;
    /// Of weight (N) and moment (N·m), by data sheet, model and readings.
    Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  };
  /// The object of this series; needs readings with and without it.
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
  // Of what stays from series to series: E by rows, the hand's relative error of mass, that of its centre of
  // mass, the tilt. Information matrix, and that times the mean.
  Eigen::VectorXd deviation_;  // standard deviations before any reading
  Eigen::MatrixXd information_;
  Eigen::VectorXd weighted_;
  std::vector<Reading> series_;
};

/// The object when its centre of mass is known to lie near the plane n·p = `offset` (m) in S, within the
/// standard deviation `deviation` (m): the weighted mean of both. The object as it is when they are apart by
/// more than `contradiction` of their common standard deviations.
[[nodiscard]] LoadEstimator::Object near_plane(LoadEstimator::Object object, const Eigen::Vector3d& n_S,
                                               double offset, double deviation, double contradiction);

}  // namespace walkman::wrench
