#pragma once

#include "apps/picture/painted_scene.h"
#include "apps/picture/snapshot.h"

namespace walkman::apps {

/// A snapshot as bodies with colours, and what a picture of it should show.
struct ScenePainting {
  picture::PaintedScene bodies;
  std::vector<Eigen::Vector3d> subject_W;  ///< corners of boxes around all but what surrounds the robot
};

/// Paints what the plant holds where the snapshot has it: the links' visual geometry, which is that of the
/// collisions where the URDF has no other. Links are told apart by their depth in the tree, so left and right
/// look alike. Of a fixed body that surrounds the robot, as a room does, only what lies below is painted.
void paint_scene(const EmulatedWorld& world, const Snapshot& snapshot, ScenePainting& painting);

}  // namespace walkman::apps
