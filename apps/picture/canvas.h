#pragma once

#include <Eigen/Core>

#include "apps/picture/picture_renderer.h"

namespace walkman::picture {

/// Draws points and lines as seen by a camera with the optical frame C, on a white square; later ones cover
/// earlier ones.
class Canvas {
 public:
  Canvas();
  /// A square of 2 `half` + 1 pixels at a point in C.
  void dot(const Eigen::Vector3d& p_C, const Rgb& colour, int half);
  void line(const Eigen::Vector3d& from_C, const Eigen::Vector3d& to_C, const Rgb& colour);
  [[nodiscard]] Picture take() { return std::move(picture_); }

 private:
  Picture picture_;
};

/// Colour from blue (0) through green to red (1).
[[nodiscard]] Rgb rainbow(float share);

}  // namespace walkman::picture
