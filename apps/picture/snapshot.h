#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "apps/shared/emulated_world.h"

namespace walkman::apps {

/// Poses of everything in the plant at one moment.
struct Snapshot {
  Time at{};
  std::vector<Eigen::Isometry3d> X_WL;  ///< of each robot link
  std::vector<Eigen::Isometry3d> X_WO;  ///< of each object
  std::vector<SceneObject> objects;     ///< with their weights at this moment
};

[[nodiscard]] Snapshot take_snapshot(const EmulatedWorld& world);

}  // namespace walkman::apps
