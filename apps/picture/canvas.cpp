#include "apps/picture/canvas.h"

#include <algorithm>
#include <cmath>

namespace walkman::picture {
namespace {

constexpr int kSide = 640;         // px
constexpr double kFocal = 420;     // px: 75 degrees
constexpr double kNearest = 0.05;  // m
constexpr double kStep = 0.0015;   // m along a line
constexpr Rgb kBackground{255, 255, 255};

}  // namespace

Canvas::Canvas() {
  picture_.width = picture_.height = kSide;
  picture_.pixels.assign(static_cast<std::size_t>(kSide) * kSide, kBackground);
}

void Canvas::dot(const Eigen::Vector3d& p_C, const Rgb& colour, int half) {
  if (!(p_C.z() > kNearest)) return;
  const double across = 0.5 * kSide + kFocal * p_C.x() / p_C.z();
  const double down = 0.5 * kSide + kFocal * p_C.y() / p_C.z();
  if (!(std::abs(across) < 2 * kSide) || !(std::abs(down) < 2 * kSide)) return;
  const auto u = static_cast<int>(std::lround(across)), v = static_cast<int>(std::lround(down));
  for (int y = std::max(0, v - half); y <= std::min(kSide - 1, v + half); ++y)
    for (int x = std::max(0, u - half); x <= std::min(kSide - 1, u + half); ++x)
      picture_.pixels[static_cast<std::size_t>(y) * kSide + static_cast<std::size_t>(x)] = colour;
}

void Canvas::line(const Eigen::Vector3d& from_C, const Eigen::Vector3d& to_C, const Rgb& colour) {
  const int steps = 1 + static_cast<int>((to_C - from_C).norm() / kStep);
  for (int i = 0; i <= steps; ++i) dot(from_C + (to_C - from_C) * i / steps, colour, 1);
}

Rgb rainbow(float share) {
  const auto part = [share](float centre) {
    const float value = std::clamp(1.5F - std::abs(4 * share - centre), 0.0F, 1.0F);
    return static_cast<std::uint8_t>(std::lround(255 * value));
  };
  return {part(3), part(2), part(1)};
}

}  // namespace walkman::picture
