#include "apps/picture/seen_picture.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace walkman::apps {
namespace {

using Colour = std::array<std::uint8_t, 3>;

constexpr int kSide = 640;        // px
constexpr double kFocal = 420;    // px: 75 degrees
constexpr double kAxis = 0.08;    // m
constexpr double kStep = 0.0015;  // m along a line
constexpr Colour kObject{70, 110, 190}, kHandle{240, 140, 20}, kCentre{20, 190, 60}, kPlane{150, 60, 170},
    kBackground{255, 255, 255};
constexpr std::array<Colour, 3> kAxes{{{220, 30, 30}, {30, 170, 30}, {30, 60, 220}}};

class Canvas {
 public:
  Canvas() {
    picture_.width = picture_.height = kSide;
    picture_.pixels.assign(static_cast<std::size_t>(kSide) * kSide, kBackground);
  }
  /// A square of 2 `half` + 1 pixels at a point in C.
  void dot(const Eigen::Vector3d& p_C, const Colour& colour, int half) {
    if (!(p_C.z() > 0.05)) return;
    const auto u = static_cast<int>(std::lround(0.5 * kSide + kFocal * p_C.x() / p_C.z()));
    const auto v = static_cast<int>(std::lround(0.5 * kSide + kFocal * p_C.y() / p_C.z()));
    for (int y = std::max(0, v - half); y <= std::min(kSide - 1, v + half); ++y)
      for (int x = std::max(0, u - half); x <= std::min(kSide - 1, u + half); ++x)
        picture_.pixels[static_cast<std::size_t>(y) * kSide + static_cast<std::size_t>(x)] = colour;
  }
  void line(const Eigen::Vector3d& from_C, const Eigen::Vector3d& to_C, const Colour& colour) {
    const int steps = 1 + static_cast<int>((to_C - from_C).norm() / kStep);
    for (int i = 0; i <= steps; ++i) dot(from_C + (to_C - from_C) * i / steps, colour, 1);
  }
  [[nodiscard]] picture::Picture take() { return std::move(picture_); }

 private:
  picture::Picture picture_;
};

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
