#pragma once

#include <optional>
#include <span>

#include <Eigen/Core>

#include "adaptation/perception/sampling.h"

namespace walkman::perception {

/// A circle in a section plane, in that plane's own coordinates.
struct Circle {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< m
  double radius = 0;                                 ///< m
};

/// Algebraic circle fit (Kåsa 1976): minimises Σ(|p − centre|² − radius²)², in closed form. Returns nullopt
/// for fewer than three points or collinear points.
[[nodiscard]] std::optional<Circle> fit_circle(std::span<const Eigen::Vector2d> points);

/// An infinite circular cylinder and the part of its axis supported by measured points. C is the cloud's
/// frame.
struct Cylinder {
  Eigen::Vector3d p_CA = Eigen::Vector3d::Zero();     ///< a point of the axis, m
  Eigen::Vector3d axis_C = Eigen::Vector3d::UnitX();  ///< unit vector
  double radius = 0;                                  ///< m
  double from = 0, to = 0;                            ///< supported part along the axis from A, m
};

/// Intersection of a ray from the sensor with a cylinder.
struct Sighting {
  Eigen::Vector3d n_C;  ///< unit normal of the surface, outwards
  double along;         ///< position along the axis from A, m
  double range;         ///< m
  double incidence;     ///< cosine between ray and normal, negative
};

/// Returns the first intersection of the ray along the unit vector `direction_C` with the cylinder between
/// its ends; nullopt if it misses.
[[nodiscard]] std::optional<Sighting> sight(const Eigen::Vector3d& direction_C, const Cylinder& cylinder);

/// Cosine between ray and normal below which a ray is ignored: at the visible rim of a cylinder a stereo
/// camera's matching window mixes object and background.
inline constexpr double kSmallestIncidence = 0.5;

/// Fits axis direction, axis position and radius to all points around `initial`, between its ends, by robust
/// nonlinear least squares (Gauss-Newton, Tukey weights), on at most `threads` threads.
///
/// The residual is the range difference along each point's ray from the sensor at C's origin, as inverse
/// range: a stereo camera's noise is uniform in disparity, and comparing along the ray instead of
/// perpendicular to the surface keeps the radius free of the bias of one-sided noisy data. Rays that meet the
/// cylinder at less than 30° are ignored. The predicted surface decides which rays count, never the measured
/// range, except through the robust weight.
///
/// `from` and `to` of the result are the ends of the points that fit, at most 5 cm beyond those of `initial`.
/// Returns nullopt if fewer than 30 points fit or the iteration leaves the neighbourhood of `initial` (5 cm).
/// The result does not depend on `threads`.
[[nodiscard]] std::optional<Cylinder> refine_cylinder(std::span<const Eigen::Vector3f> points_C,
                                                      const Cylinder& initial, const Sampling& sampling,
                                                      int threads);

/// How well the points measured on a cylinder determine it. Deviations are standard deviations.
struct CylinderFigures {
  double residual = 0;            ///< spread of the points across the surface, from their median magnitude, m
  double arc = 0;                 ///< angle about the axis over which points lie on the surface, rad
  double radius_deviation = 0;    ///< m
  double position_deviation = 0;  ///< of the axis midway between the ends, in its worse direction, m
  double axis_deviation = 0;      ///< of the axis direction, in its worse direction, rad
  /// Position along the axis from A where the radius changes most, and the change: the part beyond it minus
  /// the part before it. Both parts are at least 5 cm long. Empty if there is no room for two parts.
  struct Step {
    double along, radius_change;
  };
  std::optional<Step> step;
};

/// Returns the figures of a refined cylinder over the points it was refined to. The deviations come from the
/// scatter of the residual sums over patches of 5 cm by 60°, so that noise shared by neighbouring points does
/// not make them too small ("sandwich" estimator over clusters: Liang and Zeger 1986). Returns nullopt if
/// fewer than 6 patches have points.
[[nodiscard]] std::optional<CylinderFigures> cylinder_figures(std::span<const Eigen::Vector3f> points_C,
                                                              const Cylinder& cylinder,
                                                              const Sampling& sampling);

}  // namespace walkman::perception
