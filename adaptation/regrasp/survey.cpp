#include "adaptation/regrasp/survey.h"

#include <array>
#include <cmath>
#include <memory>

namespace walkman::regrasp {
namespace {

constexpr double kTurn = 0.25;        // rad; the object moves by a quarter of the image
constexpr double kSpindleRate = 0.6;  // rad/s: a scan every 0.9 degrees
constexpr double kSweepTimeout = 15;  // s, three times the duration of half a turn
constexpr double kWait = 0.05;        // s

}  // namespace

camera::OrganizedCloud Survey::sweep() {
  camera::OrganizedCloud cloud;
  // However this ends, the laser does not go on turning.
  const std::unique_ptr<camera::RangeCamera, void (*)(camera::RangeCamera*)> stopped(
      &camera_, [](camera::RangeCamera* camera) { camera->end_sweep(); });
  try {
    if (!camera_.begin_sweep(kSpindleRate)) return cloud;
    for (double waited = 0; !camera_.swept(cloud.points); waited += kWait) {
      if (waited > kSweepTimeout)
        throw RunStopped("the camera's laser did not complete its sweep within 15 s");
      manipulator_.hold(kWait);
    }
  } catch (const camera::Lost& lost) {
    throw RunStopped(lost.what());
  }
  cloud.width = static_cast<int>(cloud.points.size());
  cloud.height = 1;
  return cloud;
}

Survey::Found Survey::around(const Eigen::Isometry3d& X_TC, const perception::SeenObject& object) {
  Found found;
  found.sweep = sweep();
  const double depth = object.p_CCm.z(), side = depth * std::tan(kTurn);
  for (const auto& [right, down] : {std::array{side, 0.0}, {-side, 0.0}, {0.0, side}, {0.0, -side}}) {
    if (manipulator_.look_at(X_TC * Eigen::Vector3d(right, down, depth))) found.views.push_back(take_());
  }
  manipulator_.look_at(X_TC * Eigen::Vector3d(0, 0, depth));
  return found;
}

}  // namespace walkman::regrasp
