#pragma once

#include "apps/picture/painted_scene.h"
#include "apps/picture/picture_renderer.h"
#include "apps/picture/snapshot.h"

namespace walkman::apps {

/// A snapshot as coloured bodies, and what a picture of it should show.
struct ScenePainting {
  picture::PaintedScene bodies;
  std::vector<Eigen::Vector3d> subject_W;  ///< corners of boxes around all but what surrounds the robot
};

/// Paints the contents of the plant in the poses of the snapshot: the links' visual geometry, which is the
/// collision geometry where the URDF has no other. Links are distinguished by their depth in the tree, so
/// left and right look alike. Of a fixed body that surrounds the robot, as a room does, only what lies below
/// the robot is painted.
void paint_scene(const EmulatedWorld& world, const Snapshot& snapshot, ScenePainting& painting);

/// Viewpoint and resolution of a picture.
struct PictureView {
  double azimuth = 0,
         elevation = 0;       ///< of the direction towards the camera, rad; see picture::camera_around
  int width = 0, height = 0;  ///< px
  int samples = 1;            ///< rays per pixel
  int threads = 1;
};

/// Renders all of a painting, with the sun beside the camera. Throws as picture::render and
/// picture::camera_around do.
[[nodiscard]] picture::Picture portrait(const ScenePainting& painting, const PictureView& view);

}  // namespace walkman::apps
