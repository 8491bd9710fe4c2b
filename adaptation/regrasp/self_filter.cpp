#include "adaptation/regrasp/self_filter.h"

#include <limits>

namespace walkman::regrasp {
namespace {

constexpr double kOff = 0.03;  // m

}  // namespace

SelfFilter::SelfFilter(const RobotModel& model) : shapes_(motion::body_shapes(model)) {}

void SelfFilter::remove(const motion::KinematicTree& measured, const Eigen::Isometry3d& X_TC,
                        camera::OrganizedCloud& cloud) const {
  const Eigen::Isometry3d X_CT = X_TC.inverse();
  for (const motion::BodyShape& shape : shapes_) {
    const Eigen::Isometry3f X_CS = (X_CT * measured.X_WL(shape.link) * shape.X_LS).cast<float>();
    const auto within = static_cast<float>(shape.extent() + kOff);
    if (X_CS.translation().z() < -within) continue;  // behind the camera
    const Eigen::Vector3f middle_C = X_CS.translation();
    const Eigen::Isometry3f X_SC = X_CS.inverse();
    for (Eigen::Vector3f& p_C : cloud.points) {
      // False for points that are already NaN.
      if (!((p_C - middle_C).squaredNorm() < within * within)) continue;
      const Eigen::Vector3d p_S = (X_SC * p_C).cast<double>();
      if ((p_S - shape.nearest_S(p_S)).norm() - shape.rounding < kOff)
        p_C.setConstant(std::numeric_limits<float>::quiet_NaN());
    }
  }
}

}  // namespace walkman::regrasp
