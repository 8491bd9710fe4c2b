#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "drivers/camera/range_camera.h"

namespace walkman::perception {

/// Angular margins between the visible part of an object and the four sides of the image, as seen by the
/// camera, rad: infinite where the image has no border, nearly zero where the object continues beyond it.
struct ImageMargins {
  double left = std::numeric_limits<double>::infinity(), right = left, up = left, down = left;
};

/// Border of the image of an organized cloud: the image's sides, or the inner edge of a blank margin of up to
/// a twentieth of the image. A stereo camera's image also has a blank strip on the left, as wide as the
/// disparity, because the right camera does not see that region; near objects end farther from the side than
/// far ones.
class ImageBorder {
 public:
  /// `cloud`: in the optical frame (x right, y down, z forward). A cloud with fewer than 16 rows or columns
  /// counts as unorganized and has no border.
  explicit ImageBorder(const camera::OrganizedCloud& cloud);

  /// Returns whether the object made up of these points (indices into the cloud) reaches the border: anything
  /// beyond it was not seen.
  [[nodiscard]] bool cuts(std::span<const std::uint32_t> points) const;
  /// Returns the margins of the object made up of these points.
  [[nodiscard]] ImageMargins margins(std::span<const std::uint32_t> points) const;

 private:
  [[nodiscard]] bool at_border(std::uint32_t point) const;

  const camera::OrganizedCloud& cloud_;
  bool organized_;
  int left_ = 0, right_ = 0, top_ = 0, bottom_ = 0;  // columns and rows of the outermost points
  std::vector<int> first_column_;  // first column with a point in each row; the width in rows without one
  double strip_ = 0;               // width of the blank strip times depth, px m; 0 without a strip
  double focal_ = 0;               // px; 0 if no row determines it
};

}  // namespace walkman::perception
