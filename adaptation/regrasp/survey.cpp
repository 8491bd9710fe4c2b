#include "adaptation/regrasp/survey.h"

#include <array>
#include <cmath>

#include "adaptation/perception/fusion.h"

namespace walkman::regrasp {
namespace {

// About each other pose: the object moves by a quarter of the image.
constexpr double kTurn = 0.25;        // rad
constexpr float kAround = 0.1F;       // m of what it stands on
constexpr double kSpindleRate = 0.6;  // rad/s: a scan every 0.9 degrees
constexpr double kSweepTimeout = 15;  // s, three times as long as half a turn takes
constexpr double kWait = 0.05;        // s

std::vector<Eigen::Vector3f> moved(const std::vector<Eigen::Vector3f>& points, const Eigen::Isometry3d& X) {
  const Eigen::Isometry3f to = X.cast<float>();
  std::vector<Eigen::Vector3f> out;
  out.reserve(points.size());
  for (const Eigen::Vector3f& p : points) out.push_back(to * p);
  return out;
}

}  // namespace

std::vector<Eigen::Vector3f> Survey::sweep_C() {
  if (!camera_.begin_sweep(kSpindleRate)) return {};
  camera::OrganizedCloud cloud;
  for (double waited = 0; !camera_.swept(cloud.points); waited += kWait) {
    if (waited > kSweepTimeout) return {};
    manipulator_.hold(kWait);
  }
  cloud.width = static_cast<int>(cloud.points.size());
  cloud.height = 1;
  without_robot_(cloud);
  return cloud.points;
}

std::vector<Eigen::Vector3f> Survey::around(const View& first, const perception::SeenObject& object,
                                            double voxel) {
  Eigen::AlignedBox3f region;
  for (const Eigen::Vector3f& p_C : object.surface_C) region.extend(p_C);
  region.min().array() -= kAround;
  region.max().array() += kAround;
  perception::Fusion fusion(first.outside.points, region, voxel);
  fusion.add(sweep_C());
  const double depth = object.p_CCm.z(), side = depth * std::tan(kTurn);
  for (const auto& [right, down] : {std::array{side, 0.0}, {-side, 0.0}, {0.0, side}, {0.0, -side}}) {
    if (!manipulator_.look_at(first.X_TC * Eigen::Vector3d(right, down, depth))) continue;
    const View view = take_();
    fusion.add(moved(view.outside.points, first.X_TC.inverse() * view.X_TC));
  }
  manipulator_.look_at(first.X_TC * Eigen::Vector3d(0, 0, depth));
  return fusion.points();
}

}  // namespace walkman::regrasp
