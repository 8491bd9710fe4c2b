#pragma once

#include "adaptation/perception/stage_one.h"
#include "apps/picture/picture_renderer.h"
#include "drivers/camera/range_camera.h"

namespace walkman::apps {

/// A cloud as seen by its camera, with the results of Stage I: the plane's hull in purple, the object's
/// points in blue, the axes of its handles in orange, the visual centre of mass as a green dot, and the grasp
/// frame's axes, x red, y green, z blue.
[[nodiscard]] picture::Picture seen_picture(const camera::OrganizedCloud& cloud,
                                            const perception::StageOneResult& seen);

}  // namespace walkman::apps
