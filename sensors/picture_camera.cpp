#include "sensors/picture_camera.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace walkman::sensors {
namespace {

constexpr double kFilled = 0.92;    // part of the picture's width or height that the box may take
constexpr double kSteepest = 1.55;  // rad, short of straight down, where upright means nothing

}  // namespace

PictureCamera camera_around(const Eigen::AlignedBox3d& box, double azimuth, double elevation,
                            double height_angle, int width, int height) {
  if (box.isEmpty()) throw std::invalid_argument("there is nothing to look at");
  if (width < 1 || height < 1 || !(height_angle > 0 && height_angle < 3)) {
    throw std::invalid_argument("a picture without extent");
  }
  if (!std::isfinite(azimuth) || !(std::abs(elevation) <= kSteepest)) {
    throw std::invalid_argument("a camera that is not upright");
  }
  PictureCamera camera;
  camera.width = width;
  camera.height = height;
  camera.focal_px = 0.5 * height / std::tan(0.5 * height_angle);
  const Eigen::Vector3d back(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                             std::sin(elevation));
  Eigen::Matrix3d R_WC;
  R_WC.col(2) = -back;
  R_WC.col(0) = R_WC.col(2).cross(Eigen::Vector3d::UnitZ()).normalized();
  R_WC.col(1) = R_WC.col(2).cross(R_WC.col(0));
  const Eigen::Vector2d half_tangent = Eigen::Vector2d(width, height) * (0.5 * kFilled / camera.focal_px);
  double distance = 0;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner =
        R_WC.transpose() * (box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i)) - box.center());
    distance = std::max({distance, std::abs(corner.x()) / half_tangent.x() - corner.z(),
                         std::abs(corner.y()) / half_tangent.y() - corner.z()});
  }
  camera.X_WC.linear() = R_WC;
  camera.X_WC.translation() = box.center() + distance * back;
  return camera;
}

}  // namespace walkman::sensors
