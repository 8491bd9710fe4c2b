#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Geometry>

#include "sensors/parallel_jobs.h"
#include "sensors/right_view_margin.h"
#include "sensors/stereo_camera.h"

namespace walkman::sensors {

/// True disparities of the left image and which of them the right camera can match.
///
/// A surface hides a point from the right camera if it lies on the same right-image ray with a disparity
/// larger by more than `kHidingStep`. Rays towards the right camera are cast only for pixels that can be
/// hidden: one at u with u_R = u − d(u) can be only if something the left camera sees at u' > u, or something
/// to the right of its image, has u'_R <= u_R. (On a hidden point's ray to the right camera, every point has
/// the same u_R, and projects into the left image at u_R plus its larger disparity; what the left camera sees
/// there is at least as near.) Pixels sample that image, so a hiding surface narrower than a pixel in its row
/// can be missed.
class StereoRays {
 public:
  static constexpr float kHidingStep = 1.0F / 16;  ///< px
  static constexpr int kBandRows = 8;
  static constexpr std::uint32_t kNothing = ~std::uint32_t{0};

  enum class HiddenTest { kWhereNeeded, kEveryPixel, kNone };

  StereoRays(const StereoOptions& options, int workers);
  ~StereoRays();

  /// Row stride of the images below, px, and number of bands of kBandRows rows; both cover partial tiles.
  [[nodiscard]] int stride() const { return stride_; }
  [[nodiscard]] int bands() const { return bands_; }

  /// Prepares a frame. `scene` must stay unchanged until its last band is cast.
  void begin(const RayScene& scene, const Eigen::Isometry3d& X_WC, tbb::task_arena& arena,
             HiddenTest test = HiddenTest::kWhereNeeded);

  /// Casts rows kBandRows*band and following; bands may be cast at the same time by different workers.
  /// disparity: true disparity of the surface, px, 0 where the ray hits none; matched: the same where both
  /// cameras see it within the search range, otherwise 0; surface, unless null: index of the triangle hit,
  /// fixed ones first, kNothing for none. All are whole images of stride()*bands()*kBandRows.
  void cast_band(int band, int worker, std::vector<float>& disparity, std::vector<float>& matched,
                 std::vector<std::uint32_t>* surface = nullptr);

  /// Column of row `v` from which on the right image may show surfaces nearer than anything in the left one.
  /// Only for frames begun with `kWhereNeeded`.
  [[nodiscard]] float right_margin(int v) const { return margin_.first_column(v); }

  /// Rays cast towards the right camera since `begin`.
  [[nodiscard]] std::size_t hidden_tests() const;

 private:
  struct Worker;
  void cast_tile(int u0, int v0, Worker& worker, float* disparity, std::uint32_t* surface) const;
  void scan_row(int v, Worker& worker, const float* disparity, float* matched) const;
  void test_hidden(Worker& worker, float* matched) const;

  StereoOptions options_;
  int stride_, bands_;
  RightViewMargin margin_;
  std::array<std::uint32_t, 2> first_triangle_{};  // of each kind
  HiddenTest test_ = HiddenTest::kWhereNeeded;
  float focal_baseline_ = 0;                           // px·m
  Eigen::Vector3f p_WLo_, p_LR_W_;                     // left camera's centre; from there to the right one's
  std::vector<float> column_x_, column_y_, column_z_;  // part of the ray direction that depends on the column
  std::vector<Eigen::Vector3f> row_;                   // and on the row; their sum has depth 1
  std::vector<std::unique_ptr<Worker>> workers_;
};

/// By how much the true disparity of the surface that each pixel of a row shows changes per pixel, px/px,
/// along the row and down the column. On either side of an edge, the smaller of the two differences is that
/// of the surface itself.
struct DisparitySlopes {
  std::vector<float> along, down;

  /// Finds those of row `v` in an image of `height` rows of `width` pixels, `stride` apart.
  void find(const std::vector<float>& disparity, int v, int width, int height, int stride);
};

}  // namespace walkman::sensors
