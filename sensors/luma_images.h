#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Geometry>

#include "sensors/painted_surfaces.h"
#include "sensors/parallel_jobs.h"
#include "sensors/stereo_camera.h"
#include "sensors/stereo_rays.h"
#include "sensors/surface_points.h"

namespace walkman::sensors {

/// What the pair's two imagers see, rectified, linear in light.
///
/// The left image shades what the stereo rays met. The right one shows the same points where the right camera
/// sees them, by their disparity, and casts rays of its own where none of them falls: beside nearer things,
/// and right of the left view, where what is out of it may be nearer. What the right camera alone sees of a
/// near thing in front of a surface that both see is left out.
class LumaImages {
 public:
  LumaImages(const StereoOptions& options, int workers);
  ~LumaImages();

  /// Prepares a frame: lights every triangle. `surfaces` of the scene are referred to until the next.
  void begin(const RayScene& scene, const PaintedSurfaces& surfaces, const Eigen::Isometry3d& X_WC,
             std::uint64_t seed, std::uint64_t frame, tbb::task_arena& arena);
  /// Row `v`, from StereoRays' disparities of it and the points that it shows. Bands may be drawn at the same
  /// time by different workers.
  void draw_row(int v, int worker, const StereoRays& rays, const float* disparity,
                const SurfacePoints& points, StereoImages& images);
  /// The band's right image, after all its rows.
  void finish_band(int band, int worker, StereoImages& images);

 private:
  struct Worker;
  void light(const RayScene& scene, const Eigen::Vector3f& p_WCo, tbb::task_arena& arena);
  /// What comes from points; kept in the worker.
  void shade(Worker& worker, const SurfacePoints& points) const;
  void warp(int v, Worker& worker, const float* disparity, float margin) const;
  void fill_holes(int first, int last, Worker& worker) const;
  void cast_holes(Worker& worker) const;
  void expose(int v, int camera, Worker& worker, const float* signals, std::uint8_t* out) const;

  StereoOptions options_;
  const PaintedSurfaces* surfaces_ = nullptr;
  std::uint64_t seed_ = 0, frame_ = 0;
  std::vector<float> light_;                 // on each triangle
  std::vector<SurfacePoints::Placed> X_BR_;  // right camera, in each body
  Eigen::Matrix3f R_WC_;
  Eigen::Vector3f p_WRo_;
  std::vector<std::unique_ptr<Worker>> workers_;
};

}  // namespace walkman::sensors
