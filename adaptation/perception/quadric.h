#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <Eigen/Core>

namespace walkman::perception {

// Frame C is the cloud's, with the sensor at its origin.

/// A quadric surface: q(P) = sᵀAs + bᵀs + c = 0 with s = (p_CP − p_CO)/scale.
struct Quadric {
  Eigen::Vector3d p_CO = Eigen::Vector3d::Zero();  ///< mean of the points it was fitted to, m
  double scale = 1;                                ///< m
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();     ///< symmetric
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double c = 0;
};

/// Principal curvatures of the quadric's level surface through a point, signed with respect to its normal:
/// positive where the surface bends away from the normal (convex seen from its side).
struct PrincipalCurvatures {
  double largest = 0, smallest = 0;                             ///< 1/m, ordered by magnitude
  Eigen::Vector3d along_smallest_C = Eigen::Vector3d::UnitX();  ///< unit vector, tangent to the surface
  Eigen::Vector3d n_C = Eigen::Vector3d::UnitZ();               ///< unit normal, towards the sensor
};

/// Algebraic fit with Taubin's normalisation (Taubin 1991): minimises Σq² / Σ|∇q|² over the points of
/// `points_C` with indices `chosen`. Moments are centred and scaled, and the constant is eliminated. Returns
/// nullopt for fewer than 10 points or points without extent.
[[nodiscard]] std::optional<Quadric> fit_quadric(std::span<const Eigen::Vector3f> points_C,
                                                 std::span<const std::uint32_t> chosen);

/// Returns the curvatures at P; nullopt where the gradient vanishes.
[[nodiscard]] std::optional<PrincipalCurvatures> principal_curvatures(const Quadric& quadric,
                                                                      const Eigen::Vector3d& p_CP);

}  // namespace walkman::perception
