#pragma once

#include <optional>
#include <span>

#include <Eigen/Geometry>

namespace walkman::perception {

/// How what was seen has moved: the rigid motion that brings `before` onto `now`, both in one frame (m), by
/// iterative closest points (Besl and McKay, PAMI 14(2), 1992). `reach` (m): farther from each other no two
/// points belong together. What a surface does not tell, a cylinder's turn about its axis for one, means
/// nothing, nor does its motion along an axis whose end is cut off in one of the two.
///
/// What lies within `still` (m) of `now`, in the mean or by more than half of its points, has not moved: the
/// identity. Registered, a long handle slides along itself and turns where its collars meet other ones, and a
/// short piece of one, the rest hidden by the hand, goes to whatever is near.
///
/// None when less than half of `before` has a point of `now` within reach of where it comes to.
[[nodiscard]] std::optional<Eigen::Isometry3d> motion_of(std::span<const Eigen::Vector3f> before,
                                                         std::span<const Eigen::Vector3f> now, double reach,
                                                         double still);

}  // namespace walkman::perception
