#include "apps/picture/seen_picture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/picture/canvas.h"

namespace walkman::apps {
namespace {

using picture::Canvas, picture::Rgb;

constexpr double kAxis = 0.08;  // m
constexpr Rgb kObject{70, 110, 190}, kHandle{240, 140, 20}, kCentre{20, 190, 60}, kPlane{150, 60, 170},
    kBackground{255, 255, 255};
constexpr std::array<Rgb, 3> kAxes{{{220, 30, 30}, {30, 170, 30}, {30, 60, 220}}};

}  // namespace

picture::Picture seen_picture(const camera::OrganizedCloud& cloud, const perception::StageOneResult& seen) {
  Canvas canvas;
  for (const Eigen::Vector3f& p : cloud.points) {
    if (!p.allFinite()) continue;
    const auto grey = static_cast<std::uint8_t>(std::clamp(250.0 - 75 * p.z(), 60.0, 230.0));
    canvas.dot(p.cast<double>(), {grey, grey, grey}, 0);
  }
  const std::vector<Eigen::Vector3d>& hull = seen.plane.hull_C;
  for (std::size_t i = 0; i < hull.size(); ++i) canvas.line(hull[i], hull[(i + 1) % hull.size()], kPlane);
  const perception::SeenObject& object = seen.object();
  for (const Eigen::Vector3f& p : object.surface_C) canvas.dot(p.cast<double>(), kObject, 1);
  for (const perception::Handle& handle : object.handles)
    canvas.line(handle.p_CM + handle.from * handle.axis_C, handle.p_CM + handle.to * handle.axis_C, kHandle);
  if (seen.grasp) {
    const Eigen::Isometry3d& X_CG = seen.grasp->X_CG;
    for (int axis = 0; axis < 3; ++axis)
      canvas.line(X_CG.translation(), X_CG.translation() + kAxis * X_CG.linear().col(axis),
                  kAxes[static_cast<std::size_t>(axis)]);
  }
  canvas.dot(object.p_CCm, kCentre, 5);
  return canvas.take();
}

}  // namespace walkman::apps
