#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <Eigen/Core>

namespace walkman::perception {

/// A quadric surface: q(p) = sᵀAs + bᵀs + c = 0 with s = (p − origin)/scale.
struct Quadric {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< m
  double scale = 1;                                  ///< m
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();       ///< symmetric
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double c = 0;

  [[nodiscard]] double value(const Eigen::Vector3d& p) const;
};

/// Principal curvatures of the quadric's level surface through a point, signed about `normal`: a curvature is
/// positive where the surface bends away from the normal (convex seen from its side).
struct PrincipalCurvatures {
  double largest = 0, smallest = 0;                          ///< 1/m, by magnitude
  Eigen::Vector3d along_largest = Eigen::Vector3d::UnitX();  ///< unit vectors
  Eigen::Vector3d along_smallest = Eigen::Vector3d::UnitY();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};

/// Algebraic fit with Taubin's normalisation (Taubin 1991): minimises Σq² / Σ|∇q|² over the points `chosen`
/// of `points`. Moments are centred and scaled, the constant is eliminated. None for fewer than 10 points or
/// points without extent.
[[nodiscard]] std::optional<Quadric> fit_quadric(std::span<const Eigen::Vector3f> points,
                                                 std::span<const std::uint32_t> chosen);

/// Curvatures at `p`, with the normal towards the sensor at the frame's origin. None where the gradient
/// vanishes.
[[nodiscard]] std::optional<PrincipalCurvatures> principal_curvatures(const Quadric& quadric,
                                                                      const Eigen::Vector3d& p);

}  // namespace walkman::perception
