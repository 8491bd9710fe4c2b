#include "apps/picture/picture_renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include <embree3/rtcore.h>

#include "sensors/parallel_jobs.h"
#include "sensors/ray_scene_access.h"

namespace walkman::picture {
namespace {

using Colour = Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kOffSurface = 1e-4F;  // m, keeps a ray from hitting the surface it starts on

const Colour kSun(1.30F, 1.24F, 1.16F);
const Colour kSkyLight(0.54F, 0.60F, 0.68F);
const Colour kGroundLight(0.34F, 0.32F, 0.30F);
const Colour kHorizon(0.66F, 0.70F, 0.74F);
const Colour kZenith(0.36F, 0.45F, 0.56F);
constexpr float kHeadLight = 0.16F;
constexpr float kHighlightPower = 48;
constexpr float kGridSpacing = 0.25F;  // m
constexpr float kGridLine = 0.006F;    // m, wide
constexpr float kMetreLine = 0.014F;   // m, every fourth line
constexpr float kGridShade = 0.72F;

/// Positions of the rays of one sample within a pixel, on the sun's disc and on the sky, all in [0, 1).
struct Sample {
  std::array<float, 6> u;
};

/// A Kronecker sequence: the fractional parts of multiples of the powers of the generalised golden ratio in
/// six dimensions, which fill the unit cube evenly for every number of samples.
std::vector<Sample> sample_sequence(int count) {
  double ratio = 1.1;
  for (int i = 0; i < 60; ++i) ratio = std::pow(1 + ratio, 1.0 / 7);  // the root of x⁷ = x + 1
  std::vector<Sample> sequence(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    double power = 1;
    for (float& value : sequence[i].u) {
      power /= ratio;
      const double x = 0.5 + power * static_cast<double>(i);
      value = static_cast<float>(x - std::floor(x));
    }
  }
  return sequence;
}

/// Two unit vectors that form a right-handed frame with the unit vector `n`.
std::array<Eigen::Vector3f, 2> tangents(const Eigen::Vector3f& n) {
  const Eigen::Vector3f other = std::abs(n.z()) < 0.9F ? Eigen::Vector3f::UnitZ() : Eigen::Vector3f::UnitX();
  const Eigen::Vector3f t = other.cross(n).normalized();
  return {t, n.cross(t)};
}

float smooth_step(float from, float to, float x) {
  const float t = std::clamp((x - from) / (to - from), 0.0F, 1.0F);
  return t * t * (3 - 2 * t);
}

/// Share of the ground's light reflected on and beside the lines of its grid.
float grid_shade(const Eigen::Vector3f& p) {
  for (int axis = 0; axis < 2; ++axis) {
    const float line = std::round(p[axis] / kGridSpacing);
    const bool metre = std::lround(line) % 4 == 0;
    if (std::abs(p[axis] - line * kGridSpacing) < 0.5F * (metre ? kMetreLine : kGridLine)) return kGridShade;
  }
  return 1;
}

std::uint8_t to_srgb(float linear) {
  const float c = std::clamp(linear, 0.0F, 1.0F);
  const float s = c <= 0.0031308F ? 12.92F * c : 1.055F * std::pow(c, 1 / 2.4F) - 0.055F;
  return static_cast<std::uint8_t>(std::lround(255 * s));
}

class Renderer {
 public:
  Renderer(const PaintedScene& scene, const PictureCamera& camera, const Lighting& lighting, int samples)
      : scene_(scene),
        embree_(sensors::RaySceneAccess::embree_scene(scene.rays())),
        lighting_(lighting),
        sun_(lighting.p_to_sun.normalized()),
        sun_tangents_(tangents(sun_)),
        eye_(camera.X_WC.translation().cast<float>()),
        R_WC_(camera.X_WC.linear().cast<float>()),
        focal_(static_cast<float>(camera.focal_px)),
        middle_(0.5F * static_cast<float>(camera.width), 0.5F * static_cast<float>(camera.height)),
        sequence_(sample_sequence(samples)) {}

  [[nodiscard]] Colour pixel(int column, int row) const {
    Colour sum = Colour::Zero();
    for (const Sample& sample : sequence_) {
      const Eigen::Vector3f in_C((static_cast<float>(column) + sample.u[0] - middle_.x()) / focal_,
                                 (static_cast<float>(row) + sample.u[1] - middle_.y()) / focal_, 1);
      // Each sample is bounded, so that one highlight does not outshine its neighbours at an edge.
      sum += light_along((R_WC_ * in_C).normalized(), sample).cwiseMin(1.0F);
    }
    return sum / static_cast<float>(sequence_.size());
  }

 private:
  static RTCRay ray(const Eigen::Vector3f& from, const Eigen::Vector3f& direction, float reach) {
    RTCRay r{};
    r.org_x = from.x();
    r.org_y = from.y();
    r.org_z = from.z();
    r.dir_x = direction.x();
    r.dir_y = direction.y();
    r.dir_z = direction.z();
    r.tfar = reach;
    r.mask = ~0U;
    return r;
  }

  [[nodiscard]] bool free(const Eigen::Vector3f& from, const Eigen::Vector3f& direction, float reach) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay r = ray(from, direction, reach);
    rtcOccluded1(embree_, &context, &r);
    return r.tfar >= 0;
  }

  static Colour background(const Eigen::Vector3f& direction) {
    return kHorizon + (kZenith - kHorizon) * smooth_step(0, 0.7F, direction.z());
  }

  [[nodiscard]] Colour light_along(const Eigen::Vector3f& direction, const Sample& sample) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit hit{};
    hit.ray = ray(eye_, direction, std::numeric_limits<float>::infinity());
    hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(embree_, &context, &hit);
    if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) return background(direction);
    Eigen::Vector3f n = Eigen::Vector3f(hit.hit.Ng_x, hit.hit.Ng_y, hit.hit.Ng_z).normalized();
    if (n.dot(direction) > 0) n = -n;
    const Eigen::Vector3f p = eye_ + hit.ray.tfar * direction;
    const Paint& paint = scene_.paint_of(hit.hit.primID);
    Colour light = shade(p, n, direction, paint, sample);
    if (!paint.ground) return light;
    const float distance = (p - lighting_.ground_centre).head<2>().norm();
    const float fade = smooth_step(lighting_.ground_from, lighting_.ground_to, distance);
    return light + (background(direction) - light) * fade;
  }

  [[nodiscard]] Colour shade(const Eigen::Vector3f& p, const Eigen::Vector3f& n,
                             const Eigen::Vector3f& direction, const Paint& paint,
                             const Sample& sample) const {
    const Eigen::Vector3f start = p + kOffSurface * n;
    const float radius = lighting_.sun_spread * std::sqrt(sample.u[2]);
    const float turn = 2 * kPi * sample.u[3];
    const Eigen::Vector3f to_sun =
        (sun_ + radius * (std::cos(turn) * sun_tangents_[0] + std::sin(turn) * sun_tangents_[1]))
            .normalized();
    const float facing = n.dot(to_sun);
    const bool lit = facing > 0 && free(start, to_sun, lighting_.shadow_reach);
    // Directions over the sky, distributed in proportion to the cosine with the normal.
    const float sine = std::sqrt(sample.u[4]);
    const float around = 2 * kPi * sample.u[5];
    const auto [t, b] = tangents(n);
    const Eigen::Vector3f to_sky =
        sine * (std::cos(around) * t + std::sin(around) * b) + std::sqrt(1 - sample.u[4]) * n;
    const bool open = free(start, to_sky, lighting_.occlusion_reach);

    Colour light = kHeadLight * std::max(0.0F, -n.dot(direction)) * Colour::Ones();
    if (open) light += kGroundLight + (kSkyLight - kGroundLight) * (0.5F + 0.5F * n.z());
    if (lit) light += facing * kSun;
    Colour out = light.cwiseProduct(paint.colour);
    if (paint.ground) out *= grid_shade(p);
    if (lit && paint.gloss > 0) {
      const float aligned = std::max(0.0F, n.dot((to_sun - direction).normalized()));
      out += paint.gloss * std::pow(aligned, kHighlightPower) * kSun;
    }
    return out;
  }

  const PaintedScene& scene_;
  RTCSceneTy* embree_;
  Lighting lighting_;
  Eigen::Vector3f sun_;
  std::array<Eigen::Vector3f, 2> sun_tangents_;
  Eigen::Vector3f eye_;
  Eigen::Matrix3f R_WC_;
  float focal_;
  Eigen::Vector2f middle_;
  std::vector<Sample> sequence_;
};

}  // namespace

Picture render(const PaintedScene& scene, const PictureCamera& camera, const Lighting& lighting, int samples,
               int threads) {
  if (samples < 1 || threads < 1) throw std::invalid_argument("a picture needs samples and threads");
  if (camera.width < 1 || camera.height < 1) throw std::invalid_argument("a picture without pixels");
  const Renderer renderer(scene, camera, lighting, samples);
  Picture picture;
  picture.width = camera.width;
  picture.height = camera.height;
  picture.pixels.resize(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  tbb::task_arena arena(std::min(threads, tbb::info::default_concurrency()));
  sensors::run_jobs(arena, camera.height, [&](int row, int /*worker*/) {
    auto pixel = picture.pixels.begin() + static_cast<std::ptrdiff_t>(row) * camera.width;
    for (int column = 0; column < camera.width; ++column, ++pixel) {
      const Colour colour = renderer.pixel(column, row);
      *pixel = {to_srgb(colour.x()), to_srgb(colour.y()), to_srgb(colour.z())};
    }
  });
  return picture;
}

}  // namespace walkman::picture
