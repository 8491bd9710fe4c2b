#include "sensors/spinning_lidar.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "sensors/normal_distribution.h"
#include "sensors/random_stream.h"
#include "sensors/ray_batch.h"

namespace walkman::sensors {
namespace {

enum BeamTerm : std::uint64_t { kRange = 32, kBias };

// One ray at a beam's centre and six around it, which share its light evenly: at √(7/12) of its radius, so
// that the seven have the mean square radius of the disc, 1/2.
constexpr int kRays = 7;
const double kRing = std::sqrt(7.0 / 12);
constexpr int kLanes = RayBatch::kGroup;   // a group per beam, of which the last ray is off
constexpr double kKnee = 10;               // m, up to which the noise is constant
constexpr double kLeastSquareness = 0.01;  // below, a footprint is as long as anything it could lie on
constexpr int kMostBeams = 100000;
constexpr float kNoReturn = std::numeric_limits<float>::infinity();

void require(bool good, const char* expected) {
  if (!good) throw std::invalid_argument(std::string("laser scanner: expected ") + expected);
}

/// Return of a ray.
struct Echo {
  double range = 0, light = 0, squareness = 0;
};

}  // namespace

LidarOptions LidarOptions::noise_free() const {
  LidarOptions clean = *this;
  clean.beam_angle = clean.beam_radius = clean.noise = clean.noise_far = clean.noise_grazing = clean.bias = 0;
  return clean;
}

struct SpinningLidar::Impl {
  explicit Impl(int beams) : rays(beams * kLanes) {}
  RayBatch rays;
  std::vector<Eigen::Matrix<float, 3, kLanes>> off, along;  // origins and directions of its rays, laser frame
  std::vector<Echo> echoes;                                 // of one beam, kept to reuse its memory
};

SpinningLidar::SpinningLidar(const LidarOptions& options, std::uint64_t seed)
    : options_(options), seed_(seed) {
  const LidarOptions& o = options;
  require(o.beams >= 1 && o.beams <= kMostBeams, "1 to 100000 beams");
  require(o.step > 0 && o.step * o.beams <= 2 * std::numbers::pi + o.step, "beams within a turn");
  require(o.beam_period >= 0 && std::isfinite(o.beam_period), "a beam period of 0 s or more");
  require(o.least_range >= 0 && o.most_range > o.least_range && std::isfinite(o.most_range),
          "ranges from 0 m up");
  for (const double value : {o.beam_angle, o.beam_radius, o.noise, o.noise_far, o.noise_grazing, o.bias,
                             o.pulse, o.least_reflectance, o.intensity})
    require(value >= 0 && std::isfinite(value), "errors of 0 or more");
  std::array<float, 1> draw{};
  fill_normal(RandomStream(seed, 0, kBias, 0), draw);
  bias_ = options.bias * static_cast<double>(draw[0]);
  impl_ = std::make_unique<Impl>(options.beams);
  for (int i = 0; i < options.beams; ++i) {
    const double mirror = (i - 0.5 * (options.beams - 1)) * options.step;
    const Eigen::Vector3d along(std::sin(mirror), 0, std::cos(mirror));
    const Eigen::Vector3d across(std::cos(mirror), 0, -std::sin(mirror)), up = Eigen::Vector3d::UnitY();
    impl_->off.emplace_back();
    impl_->along.emplace_back();
    for (int k = 0; k < kLanes; ++k) {
      const double around = 2 * std::numbers::pi * k / (kRays - 1.0);
      Eigen::Vector3d off = Eigen::Vector3d::Zero();
      if (k > 0 && k < kRays) off = kRing * (std::cos(around) * across + std::sin(around) * up);
      impl_->off.back().col(k) = (options.beam_radius * off).cast<float>();
      impl_->along.back().col(k) = (along + options.beam_angle * off).normalized().cast<float>();
    }
  }
}

SpinningLidar::~SpinningLidar() = default;

void SpinningLidar::scan(const RayScene& scene, const std::function<Eigen::Isometry3d(double)>& X_WL,
                         std::uint64_t number, LidarScan& out) {
  surfaces_.begin(scene, seed_, PaintedSurfaces::Moved::kPlaced);
  impl_->rays.begin(surfaces_.embree_scene());
  for (int i = 0; i < options_.beams; ++i) {
    const auto beam = static_cast<std::size_t>(i);
    const Eigen::Isometry3f X = X_WL(i * options_.beam_period).cast<float>();
    const Eigen::Matrix<float, 3, kLanes> from = (X.linear() * impl_->off[beam]).colwise() + X.translation();
    const Eigen::Matrix<float, 3, kLanes> along = X.linear() * impl_->along[beam];
    const RayBatch::Group rays = impl_->rays.group(i);
    for (int k = 0; k < kLanes; ++k) {
      rays.org_x[k] = from(0, k);
      rays.org_y[k] = from(1, k);
      rays.org_z[k] = from(2, k);
      rays.dir_x[k] = along(0, k);
      rays.dir_y[k] = along(1, k);
      rays.dir_z[k] = along(2, k);
      rays.tnear[k] = k < kRays ? static_cast<float>(options_.least_range) : 1;
      rays.tfar[k] = k < kRays ? static_cast<float>(options_.most_range) : -1;
    }
  }
  {
    const DenormalsFlushed guard;
    impl_->rays.intersect(options_.beams * kLanes);
  }
  const auto beams = static_cast<std::size_t>(options_.beams);
  out.ranges.resize(beams);
  out.intensities.resize(beams);
  for (std::size_t beam = 0; beam < beams; ++beam) read(beam, number, out);
}

/// Reads the nearest surface that reflects enough light, together with everything less than a pulse behind
/// it.
void SpinningLidar::read(std::size_t beam, std::uint64_t number, LidarScan& out) const {
  const RayBatch::Group rays = impl_->rays.group(static_cast<int>(beam));
  std::vector<Echo>& echoes = impl_->echoes;
  echoes.clear();
  std::size_t last_body = surfaces_.bodies();
  double albedo = 0;
  for (int k = 0; k < kRays; ++k) {
    if (rays.geometry[k] == RayBatch::kNothing) continue;
    const Eigen::Vector3d d = Eigen::Vector3f(rays.dir_x[k], rays.dir_y[k], rays.dir_z[k]).cast<double>();
    const Eigen::Vector3d o = Eigen::Vector3f(rays.org_x[k], rays.org_y[k], rays.org_z[k]).cast<double>();
    const Eigen::Vector3d n =
        Eigen::Vector3f(rays.normal_x[k], rays.normal_y[k], rays.normal_z[k]).cast<double>();
    const auto range = static_cast<double>(rays.tfar[k]);
    const std::size_t body =
        surfaces_.body_of(surfaces_.triangle(rays.instance[k], rays.geometry[k], rays.triangle[k]));
    // An instance's normal is in its body's frame.
    const bool placed = rays.instance[k] != RayBatch::kNothing;
    const Eigen::Isometry3d& X_PB = surfaces_.pattern().X_PB(body);
    const Eigen::Vector3d n_P = X_PB.linear() * n.normalized();
    const Eigen::Isometry3d& X_PW = surfaces_.X_PW(body);
    const double squareness = std::abs(placed ? n_P.dot(X_PW.linear() * d) : n.normalized().dot(d));
    if (body != last_body) {  // the beam's rays lie within its footprint
      const double across = 2 * (options_.beam_radius + range * options_.beam_angle);
      const Eigen::Vector3f p_P = (X_PW * (o + range * d)).cast<float>();
      const auto size = static_cast<float>(across / std::sqrt(std::max(squareness, kLeastSquareness)));
      float share = 0;
      surfaces_.pattern().albedos(body, {{&p_P[0], 1}, {&p_P[1], 1}, {&p_P[2], 1}, {&size, 1}}, {&share, 1});
      albedo = static_cast<double>(share);
      last_body = body;
    }
    echoes.push_back({range, albedo * squareness / (range * range) / kRays, squareness});
  }
  std::sort(echoes.begin(), echoes.end(), [](const Echo& a, const Echo& b) { return a.range < b.range; });
  const double least = options_.least_reflectance / (options_.most_range * options_.most_range);
  out.ranges[beam] = kNoReturn;
  out.intensities[beam] = 0;
  for (std::size_t first = 0; first < echoes.size();) {
    Echo sum;
    std::size_t next = first;
    for (; next < echoes.size() && echoes[next].range < echoes[first].range + options_.pulse; ++next) {
      sum.light += echoes[next].light;
      sum.range += echoes[next].light * echoes[next].range;
      sum.squareness += echoes[next].light * echoes[next].squareness;
    }
    first = next;
    if (sum.light < least) continue;
    const double range = sum.range / sum.light, squareness = sum.squareness / sum.light;
    std::array<float, 1> draw{};
    fill_normal(RandomStream(seed_, number, kRange, beam), draw);
    const double far = std::clamp((range - kKnee) / (options_.most_range - kKnee), 0.0, 1.0);
    const double square = options_.noise + far * (options_.noise_far - options_.noise);
    const double grazing = std::max(0.0, options_.noise_grazing - options_.noise) * (1 - squareness);
    out.ranges[beam] = static_cast<float>(range + bias_ + (square + grazing) * static_cast<double>(draw[0]));
    out.intensities[beam] = static_cast<float>(options_.intensity * std::sqrt(sum.light));
    return;
  }
}

}  // namespace walkman::sensors
