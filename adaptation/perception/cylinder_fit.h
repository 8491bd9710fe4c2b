#pragma once

#include <optional>
#include <span>

#include <Eigen/Core>

#include "adaptation/perception/sampling.h"

namespace walkman::perception {

/// A circle in a plane of section, in that plane's own coordinates.
struct Circle {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< m
  double radius = 0;                                 ///< m
};

/// Algebraic circle fit (Kåsa 1976): minimises Σ(|p − centre|² − radius²)², closed form. None for fewer than
/// three points or points on a line.
[[nodiscard]] std::optional<Circle> fit_circle(std::span<const Eigen::Vector2d> points);

/// An endless circular cylinder and the part of its axis that measured points support. C is the cloud's
/// frame.
struct Cylinder {
  Eigen::Vector3d p_CA = Eigen::Vector3d::Zero();     ///< a point of the axis, m
  Eigen::Vector3d axis_C = Eigen::Vector3d::UnitX();  ///< unit vector
  double radius = 0;                                  ///< m
  double from = 0, to = 0;                            ///< supported part along the axis from A, m
};

/// Where a ray from the sensor meets a cylinder.
struct Sighting {
  Eigen::Vector3d n_C;  ///< unit normal of the surface, outwards
  double along;         ///< on the axis from A, m
  double range;         ///< m
  double incidence;     ///< cosine between ray and normal, negative
};

/// The first point where the ray along the unit vector `direction_C` meets the cylinder between its ends.
/// None when it misses.
[[nodiscard]] std::optional<Sighting> sight(const Eigen::Vector3d& direction_C, const Cylinder& cylinder);

/// Cosine between ray and normal below which a ray does not count: at the rim of what is seen of a cylinder a
/// stereo camera's matching window mixes object and background.
inline constexpr double kSmallestIncidence = 0.5;

/// Fits axis direction, axis position and radius to all points around `initial`, between its ends, by robust
/// nonlinear least squares (Gauss-Newton, Tukey weights), on at most `threads` threads.
///
/// The residual is that of the range along each point's ray from the sensor at C's origin, as inverse range:
/// a stereo camera's noise is uniform in disparity, and comparing along the ray instead of square to the
/// surface keeps the radius free of the bias of one-sided noisy data. Rays that meet the cylinder at less
/// than 30° are left out. Which rays count is decided by the predicted surface, never by the measured range,
/// except for the robust weight.
///
/// `from` and `to` of the result: the ends of the points that fit, at most 5 cm beyond those of `initial`.
/// None when fewer than 30 points fit or the iteration leaves the neighbourhood of `initial` (5 cm). Does not
/// depend on `threads`.
[[nodiscard]] std::optional<Cylinder> refine_cylinder(std::span<const Eigen::Vector3f> points_C,
                                                      const Cylinder& initial, const Sampling& sampling,
                                                      int threads);

/// How well points measured on a cylinder tell it. Deviations are standard deviations.
struct CylinderFigures {
  double residual = 0;            ///< of the points across the surface, from their median magnitude, m
  double arc = 0;                 ///< angle about the axis over which points lie on the surface, rad
  double radius_deviation = 0;    ///< m
  double position_deviation = 0;  ///< of the axis midway between the ends, in its worse direction, m
  double axis_deviation = 0;      ///< of the direction, in its worse direction, rad
  /// Where along the axis from A the radius changes most, and by how much: of the part beyond it against the
  /// part before it. Both parts are at least 5 cm long. None when there is no room for two.
  struct Step {
    double along, radius_change;
  };
  std::optional<Step> step;
};

/// Figures of a refined cylinder over the points it was refined to. The deviations come from the scatter of
/// the residuals' sums over patches of 2 cm by 30°, which noise that neighbouring points share does not make
/// too small ("sandwich" estimator over clusters: Liang and Zeger 1986). None when fewer than 8 patches have
/// points.
[[nodiscard]] std::optional<CylinderFigures> cylinder_figures(std::span<const Eigen::Vector3f> points_C,
                                                              const Cylinder& cylinder,
                                                              const Sampling& sampling);

}  // namespace walkman::perception
