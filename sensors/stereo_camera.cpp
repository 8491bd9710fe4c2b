#include "sensors/stereo_camera.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "sensors/disparity_noise.h"
#include "sensors/foreground_fattening.h"
#include "sensors/luma_images.h"
#include "sensors/painted_surfaces.h"
#include "sensors/parallel_jobs.h"
#include "sensors/stereo_rays.h"
#include "sensors/surface_points.h"

namespace walkman::sensors {
namespace {

// Bounds of the options as such, not of any real camera: they keep sizes and indices in range.
constexpr int kMostPixels = 16384;
constexpr int kMostThreads = 256;
constexpr int kMostFattening = 64;
constexpr double kMostCorrelation = 64;
constexpr double kMostSpikes = 0.2;    // so that 3 · 0.2 / 0.64, the share of patches at rank 0, is below 1
constexpr double kMostLocking = 0.15;  // below 1 over 2π, so that the order is preserved
constexpr double kLeastStep = 1e-4;

void require(bool good, const char* option, double value, const char* expected) {
  if (!good) {
    throw std::invalid_argument(std::string("stereo camera: ") + option + " is " + std::to_string(value) +
                                ", expected " + expected);
  }
}

StereoOptions checked(const StereoOptions& o) {
  const auto positive = [](double x) { return std::isfinite(x) && x > 0; };
  const auto not_negative = [](double x) { return std::isfinite(x) && x >= 0; };
  const auto fraction = [](double x) { return x >= 0 && x < 1; };
  require(o.width >= 1 && o.width <= kMostPixels, "width", o.width, "1 to 16384 px");
  require(o.height >= 1 && o.height <= kMostPixels, "height", o.height, "1 to 16384 px");
  require(positive(o.focal_px), "focal_px", o.focal_px, "a positive number of px");
  require(std::isfinite(o.cx), "cx", o.cx, "a finite number of px");
  require(std::isfinite(o.cy), "cy", o.cy, "a finite number of px");
  require(positive(o.baseline), "baseline", o.baseline, "a positive length in m");
  require(positive(o.min_depth), "min_depth", o.min_depth, "a positive length in m");
  require(o.max_disparity >= 1 && o.max_disparity <= kMostPixels, "max_disparity", o.max_disparity,
          "1 to 16384 px");
  require(not_negative(o.sigma_d), "sigma_d", o.sigma_d, "0 px or more");
  require(o.correlation_px >= 0 && o.correlation_px <= kMostCorrelation, "correlation_px", o.correlation_px,
          "0 to 64 px");
  require(o.locking >= 0 && o.locking <= kMostLocking, "locking", o.locking, "0 to 0.15 px");
  require(o.fattening_px >= 0 && o.fattening_px <= kMostFattening, "fattening_px", o.fattening_px,
          "0 to 64 px");
  require(o.spike_fraction >= 0 && o.spike_fraction <= kMostSpikes, "spike_fraction", o.spike_fraction,
          "0 to 0.2");
  require(fraction(o.dropout_fraction), "dropout_fraction", o.dropout_fraction, "at least 0 and less than 1");
  require(o.disparity_step == 0 || (o.disparity_step >= kLeastStep && o.disparity_step <= kMostPixels),
          "disparity_step", o.disparity_step, "0, or 1e-4 to 16384 px");
  require(o.threads >= 1 && o.threads <= kMostThreads, "threads", o.threads, "1 to 256");
  return o;
}

}  // namespace

StereoOptions StereoOptions::noise_free() const {
  StereoOptions clean = *this;
  clean.sigma_d = 0;
  clean.locking = 0;
  clean.fattening_px = 0;
  clean.spike_fraction = 0;
  clean.dropout_fraction = 0;
  clean.disparity_step = 0;
  return clean;
}

struct StereoCamera::Impl {
  tbb::task_arena arena;
  StereoRays rays;
  ForegroundFattening fattening;
  DisparityNoise noise;
  PaintedSurfaces surfaces;
  LumaImages luma;
  std::vector<float> disparity, matched;
  std::vector<std::uint32_t> surface;
  // For each worker:
  std::vector<std::vector<float>> scratch;
  std::vector<SurfacePoints> points;
  std::vector<DisparitySlopes> slopes;

  explicit Impl(const StereoOptions& o)
      // More threads than processors would only cause a warning by TBB.
      : arena(std::min(o.threads, tbb::info::default_concurrency())),
        rays(o, o.threads),
        fattening(o.width, o.height, rays.stride(), o.fattening_px),
        noise(o, o.threads),
        luma(o, o.threads),
        scratch(static_cast<std::size_t>(o.threads)),
        points(static_cast<std::size_t>(o.threads), SurfacePoints(static_cast<std::size_t>(o.width))),
        slopes(static_cast<std::size_t>(o.threads)) {
    const auto pixels = static_cast<std::size_t>(rays.stride()) *
                        static_cast<std::size_t>(rays.bands() * StereoRays::kBandRows);
    disparity.resize(pixels);
    matched.resize(pixels);
    surface.resize(pixels);
  }
};

StereoCamera::StereoCamera(StereoOptions options)
    : options_(checked(options)), impl_(std::make_unique<Impl>(options_)) {}
StereoCamera::~StereoCamera() = default;

void StereoCamera::capture(const RayScene& scene, const Eigen::Isometry3d& X_WC, std::uint64_t seed,
                           std::uint64_t frame, std::vector<float>& disparity, StereoImages* images) {
  if (!X_WC.matrix().allFinite()) throw std::invalid_argument("stereo camera: its pose is not finite");
  Impl& impl = *impl_;
  const std::size_t pixels =
      static_cast<std::size_t>(options_.width) * static_cast<std::size_t>(options_.height);
  disparity.resize(pixels);

  const auto for_rows = [&](int band, auto&& each) {
    const int last = std::min((band + 1) * StereoRays::kBandRows, options_.height);
    for (int v = band * StereoRays::kBandRows; v < last; ++v) each(v);
  };
  impl.rays.begin(scene, X_WC, impl.arena);
  impl.surfaces.begin(scene, seed);
  const bool shows_surfaces = impl.noise.of_surfaces() || images != nullptr;
  if (shows_surfaces) impl.surfaces.face(scene, X_WC.translation().cast<float>(), impl.arena);
  if (images != nullptr) {
    images->left.resize(pixels);
    images->right.resize(pixels);
    impl.luma.begin(impl.surfaces, X_WC, seed, frame);
  }
  run_jobs(impl.arena, impl.rays.bands(), [&](int band, int worker) {
    impl.rays.cast_band(band, worker, impl.disparity, impl.matched, &impl.surface);
    for_rows(band, [&](int v) {
      impl.fattening.widen_row(v, impl.matched, impl.scratch[static_cast<std::size_t>(worker)]);
    });
  });

  impl.noise.begin(seed, frame);
  // Separate from the casting, whose trees would be evicted from the cache.
  const std::vector<SurfacePoints::Placed> X_PC = SurfacePoints::in_patterns(impl.surfaces, X_WC);
  run_jobs(impl.arena, impl.rays.bands(), [&](int band, int worker) {
    SurfacePoints& points = impl.points[static_cast<std::size_t>(worker)];
    DisparitySlopes& slopes = impl.slopes[static_cast<std::size_t>(worker)];
    for_rows(band, [&](int v) {
      const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(v) * impl.rays.stride();
      const float* const truth = impl.disparity.data() + first;
      if (shows_surfaces) {
        points.take_row(options_, impl.surfaces, v, truth, impl.surface.data() + first);
        points.place(impl.surfaces, X_PC);
      }
      if (images != nullptr) impl.luma.draw_row(v, worker, impl.rays, truth, points, *images);
      slopes.find(impl.disparity, v, options_.width, options_.height, impl.rays.stride());
      float* const row = disparity.data() + static_cast<std::ptrdiff_t>(v) * options_.width;
      impl.fattening.row(v, impl.disparity, impl.matched, slopes, row);
      impl.noise.distort_row(v, worker, slopes, points, impl.surfaces.pattern(), row);
    });
    if (images != nullptr) impl.luma.finish_band(band, worker, *images);
  });
}

}  // namespace walkman::sensors
