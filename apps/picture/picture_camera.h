#pragma once

#include <vector>

#include <Eigen/Geometry>

namespace walkman::picture {

/// A pinhole camera. Its frame C is an optical one: x right, y down, z forward; the principal point is the
/// middle of the picture.
struct PictureCamera {
  Eigen::Isometry3d X_WC = Eigen::Isometry3d::Identity();
  int width = 0, height = 0;  ///< px
  double focal_px = 0;
};

/// Returns a camera that looks from the given direction, upright in a world whose z points up, placed as near
/// as possible with all `points_W` (m) in view, a margin around them, and in the middle of the picture.
///
/// `azimuth` is measured from W's x axis towards its y axis, `elevation` up from the horizontal, rad, both
/// for the direction towards the camera; `height_angle` is the full angle of view over the picture's height,
/// rad. Throws std::invalid_argument without finite points, for sizes that are not positive, and for a camera
/// that would look straight up or down.
[[nodiscard]] PictureCamera camera_around(const std::vector<Eigen::Vector3d>& points_W, double azimuth,
                                          double elevation, double height_angle, int width, int height);

}  // namespace walkman::picture
