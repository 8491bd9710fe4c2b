#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <Eigen/Geometry>

#include "adaptation/perception/stage_one.h"

namespace walkman::perception {
namespace {

constexpr double kUpright = 0.0872;  // sine of 5°

Eigen::Vector3d square_to(const Eigen::Vector3d& v, const Eigen::Vector3d& axis) {
  return (v - v.dot(axis) * axis).normalized();
}

}  // namespace

double Handle::nearest_graspable(double along) const {
  along = std::clamp(along, from, to);
  double best = along, distance = std::numeric_limits<double>::infinity();
  for (const double place : places) {
    const double candidate = std::clamp(along, std::max(from, place - reach), std::min(to, place + reach));
    if (std::abs(candidate - along) >= distance) continue;
    distance = std::abs(candidate - along);
    best = candidate;
  }
  return best;
}

GraspFrame grasp_frame_at(const StageOneResult& result, int handle, double along) {
  if (handle < 0 || static_cast<std::size_t>(handle) >= result.handles.size())
    throw std::out_of_range("grasp_frame_at: handle " + std::to_string(handle) + " of " +
                            std::to_string(result.handles.size()) + " does not exist");
  const Handle& h = result.handles[static_cast<std::size_t>(handle)];
  GraspFrame frame;
  frame.handle = handle;
  frame.along = std::clamp(along, h.from, h.to);
  const Eigen::Vector3d on_axis = h.centre + frame.along * h.axis;
  const Eigen::Vector3d x = h.axis.normalized();
  const bool upright = x.cross(result.plane.normal).norm() < kUpright;
  const Eigen::Vector3d y = upright ? square_to(-on_axis, x).cross(x) : square_to(result.plane.normal, x);
  frame.X_CG.linear().col(0) = x;
  frame.X_CG.linear().col(1) = y;
  frame.X_CG.linear().col(2) = x.cross(y);
  frame.X_CG.translation() = on_axis + h.radius * y;
  return frame;
}

}  // namespace walkman::perception
