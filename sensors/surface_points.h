#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "sensors/painted_surfaces.h"
#include "sensors/stereo_camera.h"

namespace walkman::sensors {

/// Points where rays hit triangles: in the camera's frame C and in the frames B of the bodies to which the
/// triangles belong. All vectors have one size; `count` entries are in use.
class SurfacePoints {
 public:
  using Placed = Eigen::Matrix<float, 3, 4>;  // X_BC, without its last row

  std::size_t count = 0;
  std::vector<float> x, y, z;           ///< in C, m
  std::vector<float> footprint;         ///< m, covered by a pixel there
  std::vector<std::uint32_t> triangle;  ///< fixed ones first
  std::vector<int> pixel;               ///< as numbered by the caller
  std::array<std::vector<float>, 3> p_B;

  explicit SurfacePoints(std::size_t most);

  /// Poses of a camera in all bodies.
  [[nodiscard]] static std::vector<Placed> in_bodies(const PaintedSurfaces& surfaces,
                                                     const Eigen::Isometry3d& X_WC);
  /// Takes the points of row `v` of the left image, from the row's disparities and triangles; `pixel` is the
  /// column.
  void take_row(const StereoOptions& options, int v, const float* disparity, const std::uint32_t* surface);
  /// Fills p_B and `runs` for a camera with the pose X_BC in each body.
  void place(const PaintedSurfaces& surfaces, const std::vector<Placed>& X_BC);

  struct Run {
    std::size_t body, first, end;
  };
  std::vector<Run> runs;  ///< of consecutive points on one body

  /// A run's points for a body's pattern.
  [[nodiscard]] SurfacePattern::Points on_body(const Run& run) const {
    const auto part = [&](const std::vector<float>& all) {
      return std::span(all).subspan(run.first, run.end - run.first);
    };
    return {part(p_B[0]), part(p_B[1]), part(p_B[2]), part(footprint)};
  }
};

}  // namespace walkman::sensors
