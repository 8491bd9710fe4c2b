#include "sensors/correlated_field.h"

#include <cmath>
#include <cstddef>

namespace walkman::sensors {

CorrelatedField::CorrelatedField(int width, int height, double s)
    : width_(width), height_(height), radius_(static_cast<int>(std::ceil(3 * s))) {
  double square = 0;
  std::vector<double> kernel;
  for (int i = 0; i <= radius_; ++i) {
    kernel.push_back(i == 0 ? 1 : std::exp(-0.5 * i * i / (s * s)));
    square += (i == 0 ? 1 : 2) * kernel.back() * kernel.back();
  }
  for (const double k : kernel) half_kernel_.push_back(static_cast<float>(k / std::sqrt(square)));
  rows_.resize(static_cast<std::size_t>(height_ + 2 * radius_) * static_cast<std::size_t>(width));
}

void CorrelatedField::prepare_row(int index, std::span<const float> white) {
  float* const out = rows_.data() + static_cast<std::ptrdiff_t>(index) * width_;
  const float* const centre = white.data() + radius_;
  for (int u = 0; u < width_; ++u) out[u] = half_kernel_[0] * centre[u];
  for (int i = 1; i <= radius_; ++i) {
    const float k = half_kernel_[static_cast<std::size_t>(i)];
    for (int u = 0; u < width_; ++u) out[u] += k * (centre[u - i] + centre[u + i]);
  }
}

void CorrelatedField::row(int v, std::span<float> out) const {
  const float* const centre = rows_.data() + static_cast<std::ptrdiff_t>(v + radius_) * width_;
  float* const to = out.data();
  for (int u = 0; u < width_; ++u) to[u] = half_kernel_[0] * centre[u];
  for (int i = 1; i <= radius_; ++i) {
    const float k = half_kernel_[static_cast<std::size_t>(i)];
    const float* const above = centre - static_cast<std::ptrdiff_t>(i) * width_;
    const float* const below = centre + static_cast<std::ptrdiff_t>(i) * width_;
    for (int u = 0; u < width_; ++u) to[u] += k * (above[u] + below[u]);
  }
}

}  // namespace walkman::sensors
