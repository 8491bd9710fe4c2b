#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "drivers/camera/range_camera.h"

namespace walkman::perception {

/// How far what is seen of an object keeps off the image's four sides, as angles at the camera, rad: infinite
/// where the image has no border, next to nothing where the object goes on beyond it.
struct ImageMargins {
  double left = std::numeric_limits<double>::infinity(), right = left, up = left, down = left;
};

/// Where the image of an organized cloud ends: at its sides, or where a margin of up to a twentieth of it is
/// blank. At the left of a stereo camera's image a strip as wide as the disparity is blank besides, since the
/// right camera does not see what is there; near objects end farther from the side than far ones.
class ImageBorder {
 public:
  /// `cloud` in the optical frame (x right, y down, z forward). One of fewer than 16 rows or columns counts
  /// as unorganized: it has no border.
  explicit ImageBorder(const camera::OrganizedCloud& cloud);

  /// Whether the object made of these points, indices of the cloud's, reaches the border: what is beyond was
  /// not seen.
  [[nodiscard]] bool cuts(std::span<const std::uint32_t> points) const;
  /// Of the object made of these points.
  [[nodiscard]] ImageMargins margins(std::span<const std::uint32_t> points) const;

 private:
  [[nodiscard]] bool at_border(std::uint32_t point) const;

  const camera::OrganizedCloud& cloud_;
  bool organized_;
  int left_ = 0, right_ = 0, top_ = 0, bottom_ = 0;  // columns and rows of the outermost points
  std::vector<int> first_column_;                    // of each row with a point; the width where none is
  double strip_ = 0;                                 // width of the blank strip times depth, px m; 0 without
  double focal_ = 0;                                 // px; 0 where no row tells
};

}  // namespace walkman::perception
