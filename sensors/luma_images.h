#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Geometry>

#include "sensors/painted_surfaces.h"
#include "sensors/stereo_camera.h"
#include "sensors/stereo_rays.h"
#include "sensors/surface_points.h"

namespace walkman::sensors {

/// Images of the pair's two imagers, rectified, linear in light.
///
/// The left image shades the points hit by the stereo rays. The right one shows the same points where the
/// right camera sees them, according to their disparity, and casts its own rays where none of them falls:
/// beside nearer objects, and to the right of the left view, where objects outside it may be nearer. Parts of
/// a near object that only the right camera sees in front of a surface seen by both are left out.
class LumaImages {
 public:
  LumaImages(const StereoOptions& options, int workers);
  ~LumaImages();

  /// Prepares a frame: lights every triangle. `surfaces`: those of the scene, facing the left camera;
  /// referenced until the next frame.
  void begin(const PaintedSurfaces& surfaces, const Eigen::Isometry3d& X_WC, std::uint64_t seed,
             std::uint64_t frame);
  /// Draws row `v` from its disparities by StereoRays and the points that it shows. Bands may be drawn at the
  /// same time by different workers.
  void draw_row(int v, int worker, const StereoRays& rays, const float* disparity,
                const SurfacePoints& points, StereoImages& images);
  /// Completes the band's right image; call after all its rows.
  void finish_band(int band, int worker, StereoImages& images);

 private:
  struct Worker;
  /// Computes the signals of points; stores them in the worker.
  void shade(Worker& worker, const SurfacePoints& points) const;
  void warp(int v, Worker& worker, const float* disparity, float margin) const;
  void fill_holes(int first, int last, Worker& worker) const;
  void cast_holes(Worker& worker) const;
  void expose(int v, int camera, Worker& worker, const float* signals, std::uint8_t* out) const;

  StereoOptions options_;
  const PaintedSurfaces* surfaces_ = nullptr;
  std::uint64_t seed_ = 0, frame_ = 0;
  std::vector<float> light_;                 // on each triangle
  std::vector<SurfacePoints::Placed> X_PR_;  // right camera's pose in each pattern
  Eigen::Vector3f p_LR_W_;                   // of the right camera from the left one
  Eigen::Matrix3f R_WC_;
  std::vector<std::unique_ptr<Worker>> workers_;
};

}  // namespace walkman::sensors
