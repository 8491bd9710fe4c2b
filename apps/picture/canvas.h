#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Core>

#include "apps/picture/picture_renderer.h"

namespace walkman::picture {

using Colour = std::array<std::uint8_t, 3>;

/// Points and lines as a camera sees them whose optical frame is C, on a white square; a later one covers an
/// earlier one.
class Canvas {
 public:
  Canvas();
  /// A square of 2 `half` + 1 pixels at a point in C.
  void dot(const Eigen::Vector3d& p_C, const Colour& colour, int half);
  void line(const Eigen::Vector3d& from_C, const Eigen::Vector3d& to_C, const Colour& colour);
  [[nodiscard]] Picture take() { return std::move(picture_); }

 private:
  Picture picture_;
};

/// From blue (0) over green to red (1).
[[nodiscard]] Colour rainbow(float share);

}  // namespace walkman::picture
