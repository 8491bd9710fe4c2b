#include "sensors/disparity_slopes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace walkman::sensors {

void DisparitySlopes::find(const std::vector<float>& disparity, int v, int width, int height, int stride) {
  along.assign(static_cast<std::size_t>(width), 0);
  down.assign(static_cast<std::size_t>(width), 0);
  const float* const d = disparity.data() + static_cast<std::ptrdiff_t>(v) * stride;
  const auto lesser = [](float before, float here, float after) {
    return std::min(std::abs(here - before), std::abs(after - here));
  };
  if (width > 1) {
    float* const out = along.data();
    for (int u = 1; u + 1 < width; ++u) out[u] = lesser(d[u - 1], d[u], d[u + 1]);
    out[0] = std::abs(d[1] - d[0]);
    out[width - 1] = std::abs(d[width - 1] - d[width - 2]);
  }
  if (height > 1) {
    const float* const above = v > 0 ? d - stride : d + stride;
    const float* const below = v + 1 < height ? d + stride : d - stride;
    float* const out = down.data();
    for (int u = 0; u < width; ++u) out[u] = lesser(above[u], d[u], below[u]);
  }
}

}  // namespace walkman::sensors
