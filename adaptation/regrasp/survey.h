#pragma once

#include <functional>
#include <vector>

#include <Eigen/Geometry>

#include "adaptation/perception/stage_one.h"
#include "adaptation/regrasp/manipulator.h"
#include "drivers/camera/range_camera.h"

namespace walkman::regrasp {

/// Looks at an object from further poses of the head, and with the camera's laser where it has one (paper,
/// sec. 5: several clouds of an object, registered).
class Survey {
 public:
  /// A cloud without the robot in it, from where it was taken.
  struct View {
    camera::OrganizedCloud outside;
    Eigen::Isometry3d X_TC;
  };
  /// References are kept. `take` takes a view with the robot at rest; `without_robot` removes the robot from
  /// points in C of a head that has been still.
  Survey(Manipulator& manipulator, camera::RangeCamera& camera, std::function<View()> take,
         std::function<void(camera::OrganizedCloud&)> without_robot)
      : manipulator_(manipulator),
        camera_(camera),
        take_(std::move(take)),
        without_robot_(std::move(without_robot)) {}

  /// What is seen of `object` and around it from elsewhere, in C of the first view, voxels of edge `voxel`
  /// (m). The head ends where it was.
  [[nodiscard]] std::vector<Eigen::Vector3f> around(const View& first, const perception::SeenObject& object,
                                                    double voxel);

 private:
  [[nodiscard]] std::vector<Eigen::Vector3f> sweep_C();

  Manipulator& manipulator_;
  camera::RangeCamera& camera_;
  std::function<View()> take_;
  std::function<void(camera::OrganizedCloud&)> without_robot_;
};

}  // namespace walkman::regrasp
