#pragma once

#include <Eigen/Core>

#include "apps/picture/picture_renderer.h"

namespace walkman::picture {

/// Points and lines as a camera sees them whose optical frame is C, on a white square; a later one covers an
/// earlier one.
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

/// From blue (0) over green to red (1).
[[nodiscard]] Rgb rainbow(float share);

}  // namespace walkman::picture
