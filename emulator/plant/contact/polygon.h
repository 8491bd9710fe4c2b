#pragma once

#include <array>
#include <initializer_list>
#include <span>

#include <LinearMath/btVector3.h>

#include "emulator/plant/contact/primitive.h"

namespace walkman::plant {

/// A convex polygon in space, its corners in order; two corners are a line segment.
class Polygon {
 public:
  static constexpr std::size_t kMost = 12;  ///< corners: a square cut by a circle or by another square has 8

  Polygon() = default;
  Polygon(std::initializer_list<btVector3> corners) {
    for (const btVector3& corner : corners) push_back(corner);
  }
  void push_back(const btVector3& corner) {
    if (size_ < kMost) corners_[size_++] = corner;
  }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] const btVector3& operator[](std::size_t i) const { return corners_[i]; }
  [[nodiscard]] const btVector3* begin() const { return corners_.data(); }
  [[nodiscard]] const btVector3* end() const { return corners_.data() + size_; }

 private:
  std::array<btVector3, kMost> corners_;
  std::size_t size_ = 0;
};

/// Removes the part beyond the plane out · p = offset (Sutherland and Hodgman 1974).
void clip(Polygon& polygon, const btVector3& out, double offset);

/// Corners of the polygon within the circle, and where its edges meet the circle, seen along `normal`.
[[nodiscard]] Polygon clipped_by_circle(const Polygon& polygon, const btVector3& middle,
                                        const btVector3& normal, double radius);

/// At most four of the touches, chosen to carry the same load as all: the deepest, the one farthest from it,
/// and those farthest on either side of the line through the two.
[[nodiscard]] Touches most_spread(std::span<const Touch> touches);

}  // namespace walkman::plant
