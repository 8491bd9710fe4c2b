#include "apps/picture/picture_camera.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace walkman::picture {
namespace {

constexpr double kFilled = 0.92;    // largest share of the picture's width or height taken by the points
constexpr double kSteepest = 1.55;  // rad, less than straight down, where upright is undefined

}  // namespace

PictureCamera camera_around(const std::vector<Eigen::Vector3d>& points_W, double azimuth, double elevation,
                            double height_angle, int width, int height) {
  const bool finite =
      std::all_of(points_W.begin(), points_W.end(), [](const Eigen::Vector3d& p) { return p.allFinite(); });
  if (points_W.empty() || !finite) throw std::invalid_argument("there is nothing to look at");
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
  const Eigen::Array2d tangent = Eigen::Array2d(width, height) * (0.5 * kFilled / camera.focal_px);
  // Seen from (o, -d) in the camera's axes, a point (r, z) is within the margin when |r - o| <= tangent (z +
  // d).
  Eigen::Array2d right = Eigen::Array2d::Constant(-std::numeric_limits<double>::infinity());
  Eigen::Array2d left = right;
  for (const Eigen::Vector3d& p_W : points_W) {
    const Eigen::Vector3d p = R_WC.transpose() * p_W;
    right = right.max(p.head<2>().array() - tangent * p.z());
    left = left.max(-p.head<2>().array() - tangent * p.z());
  }
  const Eigen::Array2d offset = (right - left) / 2;
  const double distance = ((right + left) / (2 * tangent)).maxCoeff();
  camera.X_WC.linear() = R_WC;
  camera.X_WC.translation() = R_WC * Eigen::Vector3d(offset.x(), offset.y(), -distance);
  return camera;
}

}  // namespace walkman::picture
