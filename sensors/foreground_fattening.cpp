#include "sensors/foreground_fattening.h"

#include <algorithm>

namespace walkman::sensors {

ForegroundFattening::ForegroundFattening(int width, int height, int stride, int radius)
    : width_(width), height_(height), stride_(stride), radius_(radius) {
  if (radius > 0) widened_.resize(start(height));
}

void ForegroundFattening::widen_row(int v, const std::vector<float>& matched, std::vector<float>& scratch) {
  if (radius_ == 0) return;
  const auto radius = static_cast<std::size_t>(radius_);
  const auto width = static_cast<std::size_t>(width_);
  const float* const from = matched.data() + start(v);
  scratch.assign(width + 2 * radius, 0.0F);
  std::copy(from, from + width, scratch.data() + radius);
  float* const to = widened_.data() + start(v);
  std::copy(scratch.data(), scratch.data() + width, to);
  for (std::size_t i = 1; i <= 2 * radius; ++i) {
    const float* const shifted = scratch.data() + i;
    for (std::size_t u = 0; u < width; ++u) to[u] = to[u] > shifted[u] ? to[u] : shifted[u];
  }
}

void ForegroundFattening::row(int v, const std::vector<float>& disparity, const std::vector<float>& matched,
                              const DisparitySlopes& slopes, float* out) const {
  const float* const m = matched.data() + start(v);
  if (radius_ == 0) {
    std::copy(m, m + width_, out);
    return;
  }
  const int first = std::max(v - radius_, 0);
  const int last = std::min(v + radius_, height_ - 1);
  std::copy(widened_.data() + start(first), widened_.data() + start(first) + width_, out);
  for (int i = first + 1; i <= last; ++i) {
    const float* const w = widened_.data() + start(i);
    for (int u = 0; u < width_; ++u) out[u] = out[u] > w[u] ? out[u] : w[u];
  }
  const float* const d = disparity.data() + start(v);
  const float *const along = slopes.along.data(), *const down = slopes.down.data();
  const auto radius = static_cast<float>(radius_);
  for (int u = 0; u < width_; ++u) {
    const float rise = radius * (along[u] + down[u]);
    out[u] = out[u] > d[u] + kJump + rise ? out[u] : m[u];
  }
}

}  // namespace walkman::sensors
