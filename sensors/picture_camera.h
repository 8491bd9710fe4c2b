#pragma once

#include <Eigen/Geometry>

namespace walkman::sensors {

/// A pinhole camera. Its frame C is an optical one: x right, y down, z forward; the principal point is the
/// middle of the picture.
struct PictureCamera {
  Eigen::Isometry3d X_WC = Eigen::Isometry3d::Identity();
  int width = 0, height = 0;  ///< px
  double focal_px = 0;
};

/// The camera that looks at the middle of `box` from the direction given, upright in a world whose z points
/// up, as near as lets all of the box be seen with a margin around it.
///
/// `azimuth` turns from W's x axis to its y axis, `elevation` up from the horizontal, rad, both of the
/// direction from the box to the camera; `height_angle` is the full angle of view over the picture's height,
/// rad. Throws std::invalid_argument for an empty box, sizes that are not positive, or a camera that would
/// look straight up or down.
[[nodiscard]] PictureCamera camera_around(const Eigen::AlignedBox3d& box, double azimuth, double elevation,
                                          double height_angle, int width, int height);

}  // namespace walkman::sensors
