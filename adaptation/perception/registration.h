#pragma once

#include <optional>
#include <span>

#include <Eigen/Geometry>

namespace walkman::perception {

/// Estimates how the visible surface has moved: the rigid motion that brings `before` onto `now`, both in one
/// frame (m), by iterative closest points (Besl and McKay, PAMI 14(2), 1992). `reach` (m): largest distance
/// between corresponding points. Components that a surface does not determine, such as a cylinder's rotation
/// about its axis, are meaningless, and so is translation along an axis whose end is cut off in one of the
/// two.
///
/// If `before` lies within `still` (m) of `now`, on average or for more than half of its points, it has not
/// moved: returns the identity. Registration would slide a long handle along itself and turn it where its
/// collars match others, and would draw a short piece of one, the rest hidden by the hand, to any surface
/// nearby.
///
/// Returns nullopt if less than half of `before` ends up within reach of a point of `now`.
[[nodiscard]] std::optional<Eigen::Isometry3d> motion_of(std::span<const Eigen::Vector3f> before,
                                                         std::span<const Eigen::Vector3f> now, double reach,
                                                         double still);

}  // namespace walkman::perception
