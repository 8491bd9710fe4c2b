#pragma once

#include <optional>
#include <span>

#include <Eigen/Core>

namespace walkman::perception {

struct Circle {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< m
  double radius = 0;                                 ///< m
};

/// Algebraic circle fit (Kasa): minimises Σ(|p − centre|² − radius²)², closed form. None for points on a
/// line.
[[nodiscard]] std::optional<Circle> fit_circle(std::span<const Eigen::Vector2d> points);

/// An endless circular cylinder and the part of its axis that measured points support.
struct Cylinder {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< of the axis, m
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< unit vector
  double radius = 0;                                ///< m
  double from = 0, to = 0;                          ///< supported part along the axis from `point`, m
};

/// Fits axis direction, axis position and radius to all `points` around `initial`, between its ends, by
/// robust nonlinear least squares (Gauss-Newton, Tukey weights).
///
/// The residual is that of the range along each point's ray from the sensor at the frame's origin, as inverse
/// range: a stereo camera's noise is uniform in disparity, and comparing along the ray instead of square to
/// the surface keeps the radius free of the bias of one-sided noisy data. Rays that meet the cylinder at less
/// than 30° are left out: there the matcher's window mixes object and background. Which rays count is decided
/// by the predicted surface, never by the measured range, except for the robust weight.
///
/// `from` and `to` of the result: the ends of the points that fit, at most 5 cm beyond those of `initial`.
/// None when fewer than 30 points fit or the iteration leaves the neighbourhood of `initial` (5 cm).
[[nodiscard]] std::optional<Cylinder> refine_cylinder(std::span<const Eigen::Vector3f> points,
                                                      const Cylinder& initial);

}  // namespace walkman::perception
