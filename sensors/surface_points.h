#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "sensors/painted_surfaces.h"
#include "sensors/stereo_camera.h"

namespace walkman::sensors {

/// Points where rays hit triangles: in the camera's frame C and in the frames P of the patterns of the bodies
/// to which the triangles belong. All vectors have one size; `count` entries are in use.
class SurfacePoints {
 public:
  using Placed = Eigen::Matrix<float, 3, 4>;  // X_PC, without its last row

  std::size_t count = 0;
  std::vector<float> x, y, z;           ///< in C, m
  std::vector<float> footprint;         ///< m, root of the area of surface that a pixel covers there
  std::vector<std::uint32_t> triangle;  ///< fixed ones first
  std::vector<int> pixel;               ///< as numbered by the caller
  std::array<std::vector<float>, 3> p_P;

  explicit SurfacePoints(std::size_t most);

  /// Poses of a camera in all patterns.
  [[nodiscard]] static std::vector<Placed> in_patterns(const PaintedSurfaces& surfaces,
                                                       const Eigen::Isometry3d& X_WC);
  /// Takes the points of row `v` of the left image, from the row's disparities and triangles, which are to
  /// face this camera; `pixel` is the column.
  void take_row(const StereoOptions& options, const PaintedSurfaces& surfaces, int v, const float* disparity,
                const std::uint32_t* surface);
  /// Area that a pixel covers is (z/f)² for a surface parallel to the image, and grows with the angle between
  /// ray and normal: z³/(f² h), with h the distance of the camera from the triangle's plane. m.
  [[nodiscard]] static float footprint_at(float z, float per_focal, float h) {
    constexpr float kLeastPart = 1e-4F;  // of z, where rounding decides about h
    return z * per_focal * std::sqrt(z / std::max(h, kLeastPart * z));
  }
  /// Fills p_P and `runs` for a camera with the pose X_PC in each pattern.
  void place(const PaintedSurfaces& surfaces, const std::vector<Placed>& X_PC);

  struct Run {
    std::size_t body, first, end;
  };
  std::vector<Run> runs;  ///< of consecutive points on one body

  [[nodiscard]] SurfacePattern::Points in_pattern(const Run& run) const {
    const auto part = [&](const std::vector<float>& all) {
      return std::span(all).subspan(run.first, run.end - run.first);
    };
    return {part(p_P[0]), part(p_P[1]), part(p_P[2]), part(footprint)};
  }
};

}  // namespace walkman::sensors
