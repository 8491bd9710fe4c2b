#pragma once

#include <optional>
#include <span>

#include <Eigen/Core>

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

/// Fits axis direction, axis position and radius to all points around `initial`, between its ends, by robust
/// nonlinear least squares (Gauss-Newton, Tukey weights).
///
/// The residual is that of the range along each point's ray from the sensor at C's origin, as inverse range:
/// a stereo camera's noise is uniform in disparity, and comparing along the ray instead of square to the
/// surface keeps the radius free of the bias of one-sided noisy data. Rays that meet the cylinder at less
/// than 30° are left out: there the matcher's window mixes object and background. Which rays count is decided
/// by the predicted surface, never by the measured range, except for the robust weight.
///
/// `from` and `to` of the result: the ends of the points that fit, at most 5 cm beyond those of `initial`.
/// None when fewer than 30 points fit or the iteration leaves the neighbourhood of `initial` (5 cm).
[[nodiscard]] std::optional<Cylinder> refine_cylinder(std::span<const Eigen::Vector3f> points_C,
                                                      const Cylinder& initial);

}  // namespace walkman::perception
