#pragma once

#include <functional>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "adaptation/perception/stage_one.h"
#include "adaptation/regrasp/manipulator.h"
#include "drivers/camera/range_camera.h"

namespace walkman::regrasp {

/// Looks at an object from further head poses, and with the camera's laser if it has one (the paper's future
/// work: several registered clouds of an object).
class Survey {
 public:
  /// A cloud without the robot in it, and the camera pose it was taken from.
  struct View {
    camera::OrganizedCloud outside;
    Eigen::Isometry3d X_TC;
  };
  struct Found {
    std::vector<View> views;
    /// Cloud of the laser from the initial head pose, with the robot in it; empty without a laser.
    camera::OrganizedCloud sweep;
  };

  /// Keeps references. `take` takes a view with the robot at rest.
  Survey(Manipulator& manipulator, camera::RangeCamera& camera, std::function<View()> take)
      : manipulator_(manipulator), camera_(camera), take_(std::move(take)) {}

  /// Returns views of `object`, first seen by a camera at X_TC, from around it; `take` must not change
  /// either. The head ends where it was, to within the smallest turn it makes.
  [[nodiscard]] Found around(const Eigen::Isometry3d& X_TC, const perception::SeenObject& object);

 private:
  [[nodiscard]] camera::OrganizedCloud sweep();

  Manipulator& manipulator_;
  camera::RangeCamera& camera_;
  std::function<View()> take_;
};

}  // namespace walkman::regrasp
