#include "drivers/camera/multisense/sweep.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace walkman::multisense {
namespace {

constexpr double kMostSkew = 1e-3;  // orthonormality error, as with floats in a calibration file

Eigen::Isometry3d transform_of(const std::array<float, 16>& rows, const char* which) {
  const Eigen::Matrix4d m =
      Eigen::Map<const Eigen::Matrix<float, 4, 4, Eigen::RowMajor>>(rows.data()).cast<double>();
  const Eigen::Matrix3d R = m.topLeftCorner<3, 3>();
  if (!m.allFinite() || (R * R.transpose() - Eigen::Matrix3d::Identity()).norm() > kMostSkew ||
      R.determinant() < 0)
    throw std::runtime_error(std::string("the laser's calibration: the pose of the ") + which +
                             " is not a rigid transform");
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = Eigen::Quaterniond(R).normalized().toRotationMatrix();
  X.translation() = m.topRightCorner<3, 1>();
  return X;
}

/// Between −π and π.
double wrapped(double angle) { return std::remainder(angle, 2 * std::numbers::pi); }

}  // namespace

Sweep::Sweep(const LidarCalibration& calibration)
    : X_SpL_(transform_of(calibration.X_SpL, "laser relative to the spindle")),
      X_CSp_(transform_of(calibration.X_CSp, "spindle relative to the camera")) {}

void Sweep::add(const LidarData& scan, const std::function<Eigen::Isometry3d(Time)>& X_FC) {
  const double from = 1e-6 * scan.first_microradians;
  const double turn = wrapped(1e-6 * scan.last_microradians - from);
  if (begun_) turned_ += std::abs(wrapped(from - last_angle_));
  turned_ += std::abs(turn);
  last_angle_ = from + turn;
  begun_ = true;
  const Time first = time_of(scan.first), span = time_of(scan.last) - first;
  const std::size_t count = scan.ranges_mm.size();
  for (std::size_t i = 0; i < count; ++i) {
    if (scan.ranges_mm[i] == 0 || scan.ranges_mm[i] > LidarData::kMostRange) continue;
    const double share = count > 1 ? static_cast<double>(i) / static_cast<double>(count - 1) : 0;
    const double mirror = (share - 0.5) * LidarData::kArc;
    const double range = 1e-3 * scan.ranges_mm[i];
    const Eigen::Vector3d p_L(range * std::sin(mirror), 0, range * std::cos(mirror));
    const Eigen::AngleAxisd spun(from + share * turn, Eigen::Vector3d::UnitZ());
    const Time at = first + Time(std::llround(share * static_cast<double>(span.count())));
    points_.push_back({(X_FC(at) * (X_CSp_ * (spun * (X_SpL_ * p_L)))).cast<float>(),
                       static_cast<float>(scan.intensities[i])});
  }
}

}  // namespace walkman::multisense
