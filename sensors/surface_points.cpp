#include "sensors/surface_points.h"

#include "sensors/stereo_rays.h"

namespace walkman::sensors {

SurfacePoints::SurfacePoints(std::size_t most) : triangle(most), pixel(most) {
  for (auto* values : {&x, &y, &z, &footprint, &p_P[0], &p_P[1], &p_P[2]}) values->resize(most);
}

std::vector<SurfacePoints::Placed> SurfacePoints::in_patterns(const PaintedSurfaces& surfaces,
                                                              const Eigen::Isometry3d& X_WC) {
  std::vector<Placed> X_PC;
  X_PC.reserve(surfaces.bodies());
  for (std::size_t body = 0; body < surfaces.bodies(); ++body)
    X_PC.emplace_back((surfaces.X_PW(body) * X_WC).matrix().topRows<3>().cast<float>());
  return X_PC;
}

void SurfacePoints::take_row(const StereoOptions& options, const PaintedSurfaces& surfaces, int v,
                             const float* disparity, const std::uint32_t* surface) {
  const auto focal_baseline = static_cast<float>(options.focal_px * options.baseline);
  const auto per_focal = static_cast<float>(1 / options.focal_px);
  const float row = (static_cast<float>(v) - static_cast<float>(options.cy)) * per_focal;
  const auto cx = static_cast<float>(options.cx);
  count = 0;
  for (int u = 0; u < options.width; ++u) {
    pixel[count] = u;
    triangle[count] = surface[u];
    count += surface[u] == StereoRays::kNothing ? 0 : 1;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const int u = pixel[i];
    const float depth = focal_baseline / disparity[u];
    x[i] = (static_cast<float>(u) - cx) * per_focal * depth;
    y[i] = row * depth;
    z[i] = depth;
    footprint[i] = footprint_at(depth, per_focal, surfaces.side(triangle[i]).distance);
  }
}

void SurfacePoints::place(const PaintedSurfaces& surfaces, const std::vector<Placed>& X_PC) {
  runs.clear();
  for (std::size_t first = 0, end = 0; first < count; first = end) {
    const std::size_t body = surfaces.body_of(triangle[first]);
    for (end = first + 1; end < count && surfaces.body_of(triangle[end]) == body;) ++end;
    runs.push_back({body, first, end});
    const float *px = x.data(), *py = y.data(), *pz = z.data();
    for (int axis = 0; axis < 3; ++axis) {
      float* const to = p_P[static_cast<std::size_t>(axis)].data();
      const float ax = X_PC[body](axis, 0), ay = X_PC[body](axis, 1), az = X_PC[body](axis, 2),
                  shift = X_PC[body](axis, 3);
      for (std::size_t i = first; i < end; ++i) to[i] = ax * px[i] + ay * py[i] + az * pz[i] + shift;
    }
  }
}

}  // namespace walkman::sensors
