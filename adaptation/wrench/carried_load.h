#pragma once

#include <optional>

#include <Eigen/Geometry>

#include "urdf/reader/wrench.h"

namespace walkman::wrench {

/// Running mean of a wrench; all samples about one point in one frame.
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

/// Mean rate of change of a wrench: the slope of the least-squares line through its samples.
class WrenchTrend {
 public:
  /// `time` in s; all samples about one point in one frame.
  void add(double time, const Wrench& sample);

  /// N/s and N·m/s. Zero with fewer than two samples.
  [[nodiscard]] Wrench slope() const;

 private:
  int count_ = 0;
  double mean_time_ = 0, time_squares_ = 0;  // s, s²: sum of squared deviations from the mean
  Wrench mean_, products_;                   // sums of time deviations times wrench deviations
};

/// Moves a wrench from Po to Qo; p_PQ is Qo relative to Po (m), all in one frame E.
[[nodiscard]] Wrench shift(const Wrench& F_Po_E, const Eigen::Vector3d& p_PQ_E);

/// Possible positions of a load's centre of mass, relative to the point Po about which the load was measured:
/// a line along the force (paper, sec. 3.2: d = λ f + f × τ / |f|²), in the wrench's frame E.
struct ComLine {
  Eigen::Vector3d p_PF = Eigen::Vector3d::Zero();        ///< the line's point nearest to Po (λ = 0), m
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< unit vector along the force
};

/// Returns the CoM line of a weight from its wrench; std::nullopt if the force is below `min_force` (N) or
/// not finite: there is nothing to be weighed.
[[nodiscard]] std::optional<ComLine> com_line(const Wrench& F_Po_E, double min_force);

/// Distance between a line and a box in the same frame, m: 0 if the line passes through it. Searches within
/// 100 m of the line's point.
[[nodiscard]] double distance_of(const ComLine& line, const Eigen::AlignedBox3d& box);

/// Norm (N·m) of the torque about Q, which is p_PQ from Po (m), of a force of norm `force` (N) along the
/// line: |d_h × f| in the paper.
[[nodiscard]] double torque_about(const ComLine& line, double force, const Eigen::Vector3d& p_PQ);

}  // namespace walkman::wrench
