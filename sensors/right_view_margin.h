#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "sensors/parallel_jobs.h"
#include "sensors/ray_scene_access.h"
#include "sensors/stereo_camera.h"

namespace walkman::sensors {

/// Finds surfaces to the right of the left image and yet inside the right one, where they can hide points of
/// the left image: for each row, a lower bound of the right-image columns that such surfaces reach, +infinity
/// if there are none. Exact clipping per triangle, one bound per triangle and row.
class RightViewMargin {
 public:
  RightViewMargin(const StereoOptions& options, int workers);

  void find(const RayScene& scene, const Eigen::Isometry3d& X_WC, tbb::task_arena& arena);

  [[nodiscard]] float first_column(int row) const { return columns_[static_cast<std::size_t>(row)]; }

 private:
  struct Camera;
  void classify(const TriangleView& view, const Camera& camera, int job);
  void collect(const TriangleView& view, const Camera& camera, int job, std::vector<float>& columns) const;

  StereoOptions options_;
  std::vector<unsigned char> outside_;              // per vertex: bit i is set when it is outside plane i
  std::vector<std::vector<float>> worker_columns_;  // per worker and row
  std::vector<float> columns_;
};

}  // namespace walkman::sensors
