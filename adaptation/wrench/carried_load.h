#pragma once

#include <optional>

#include <Eigen/Geometry>

#include "urdf/reader/wrench.h"

namespace walkman::wrench {

/// Running mean of a wrench, all samples about one point in one frame.
class WrenchAverage {
 public:
  void add(const Wrench& sample);

  [[nodiscard]] int count() const { return count_; }
  /// Zero without samples.
  [[nodiscard]] const Wrench& mean() const { return mean_; }

 private:
  int count_ = 0;
  Wrench mean_;
};

/// How fast a wrench changes in the mean: the slope of the straight line that fits its samples best.
class WrenchTrend {
 public:
  /// `time` in s; samples about one point in one frame.
  void add(double time, const Wrench& sample);

  /// N/s and N·m/s. Zero with fewer than two samples.
  [[nodiscard]] Wrench slope() const;

 private:
  int count_ = 0;
  double mean_time_ = 0, time_squares_ = 0;  // s, s²: of the deviations from the mean
  Wrench mean_, products_;                   // sums of deviations of time times those of the wrench
};

/// Moves a wrench from Po to Qo; p_PQ is Qo relative to Po (m), all in one frame E.
[[nodiscard]] Wrench shift(const Wrench& F_Po_E, const Eigen::Vector3d& p_PQ_E);

/// The points a load's centre of mass may be at, seen from the point Po that the load was measured about: a
/// line along the force (paper, sec. 3.2: d = λ f + f × τ / |f|²), in the wrench's frame E.
struct ComLine {
  Eigen::Vector3d p_PF = Eigen::Vector3d::Zero();        ///< its point nearest to Po (λ = 0), m
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< unit vector along the force
};

/// The CoM line of a weight from its wrench. None when the force is below `min_force` (N) or not finite:
/// nothing hangs there that could be weighed.
[[nodiscard]] std::optional<ComLine> com_line(const Wrench& F_Po_E, double min_force);

/// How far a line passes outside of a box in the same frame, m: 0 when it goes through. Within 100 m of its
/// point.
[[nodiscard]] double distance_of(const ComLine& line, const Eigen::AlignedBox3d& box);

/// Norm (N·m) of the torque that a force of the norm `force` (N) on the line makes about Q, which is p_PQ
/// from Po (m): |d_h × f| of the paper.
[[nodiscard]] double torque_about(const ComLine& line, double force, const Eigen::Vector3d& p_PQ);

}  // namespace walkman::wrench
