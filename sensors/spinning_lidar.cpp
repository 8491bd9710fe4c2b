#include "sensors/spinning_lidar.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include <embree3/rtcore.h>

#include "sensors/normal_distribution.h"
#include "sensors/random_stream.h"

namespace walkman::sensors {
namespace {

enum BeamTerm : std::uint64_t { kRange = 32, kBias };

// One ray at a beam's centre and six around it, which share its light evenly: at √(7/12) of its radius, so
// that the seven have the mean square radius of the disc, 1/2.
constexpr std::size_t kRays = 7;
const double kRing = std::sqrt(7.0 / 12);
constexpr std::size_t kBeamPacket = 8;  // one packet per beam, of which the last lane is off
constexpr double kKnee = 10;            // m, up to which the noise is constant
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
  std::vector<RTCRayHit8> packets;                     // one per beam
  std::vector<Eigen::Matrix<float, 3, 8>> off, along;  // origins and directions of its rays, laser frame
  std::vector<Echo> echoes;                            // of one beam, kept to reuse its memory
};

SpinningLidar::SpinningLidar(const LidarOptions& options, std::uint64_t seed)
    : options_(options), seed_(seed), impl_(std::make_unique<Impl>()) {
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
  impl_->packets.resize(static_cast<std::size_t>(options.beams));
  for (int i = 0; i < options.beams; ++i) {
    const double mirror = (i - 0.5 * (options.beams - 1)) * options.step;
    const Eigen::Vector3d along(std::sin(mirror), 0, std::cos(mirror));
    const Eigen::Vector3d across(std::cos(mirror), 0, -std::sin(mirror)), up = Eigen::Vector3d::UnitY();
    impl_->off.emplace_back();
    impl_->along.emplace_back();
    for (int k = 0; k < static_cast<int>(kBeamPacket); ++k) {
      const double around = 2 * std::numbers::pi * k / (kRays - 1.0);
      Eigen::Vector3d off = Eigen::Vector3d::Zero();
      if (k > 0 && k < static_cast<int>(kRays))
        off = kRing * (std::cos(around) * across + std::sin(around) * up);
      impl_->off.back().col(k) = (options.beam_radius * off).cast<float>();
      impl_->along.back().col(k) = (along + options.beam_angle * off).normalized().cast<float>();
    }
    RTCRayHit8& packet = impl_->packets[static_cast<std::size_t>(i)];
    for (std::size_t k = 0; k < kBeamPacket; ++k) {
      packet.ray.time[k] = 0;
      packet.ray.mask[k] = ~0U;
      packet.ray.id[k] = packet.ray.flags[k] = 0;
    }
  }
}

SpinningLidar::~SpinningLidar() = default;

void SpinningLidar::scan(const RayScene& scene, const std::function<Eigen::Isometry3d(double)>& X_WL,
                         std::uint64_t number, LidarScan& out) {
  surfaces_.begin(scene, seed_, PaintedSurfaces::Moved::kPlaced);
  for (std::size_t i = 0; i < impl_->packets.size(); ++i) {
    const Eigen::Isometry3f X = X_WL(static_cast<double>(i) * options_.beam_period).cast<float>();
    const Eigen::Matrix<float, 3, 8> from = (X.linear() * impl_->off[i]).colwise() + X.translation();
    const Eigen::Matrix<float, 3, 8> along = X.linear() * impl_->along[i];
    RTCRayHit8& packet = impl_->packets[i];
    for (std::size_t k = 0; k < kBeamPacket; ++k) {
      const auto column = static_cast<Eigen::Index>(k);
      packet.ray.org_x[k] = from(0, column);
      packet.ray.org_y[k] = from(1, column);
      packet.ray.org_z[k] = from(2, column);
      packet.ray.dir_x[k] = along(0, column);
      packet.ray.dir_y[k] = along(1, column);
      packet.ray.dir_z[k] = along(2, column);
      packet.ray.tnear[k] = k < kRays ? static_cast<float>(options_.least_range) : 1;
      packet.ray.tfar[k] = k < kRays ? static_cast<float>(options_.most_range) : -1;
      packet.hit.geomID[k] = packet.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
    }
  }
  cast();
  out.ranges.resize(impl_->packets.size());
  out.intensities.resize(impl_->packets.size());
  for (std::size_t i = 0; i < impl_->packets.size(); ++i) read(i, number, out);
}

void SpinningLidar::cast() {
  const DenormalsFlushed guard;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersectNM(surfaces_.embree_scene(), &context, reinterpret_cast<RTCRayHitN*>(impl_->packets.data()),
                 kBeamPacket, static_cast<unsigned>(impl_->packets.size()), sizeof(RTCRayHit8));
}

/// Reads the nearest surface that reflects enough light, together with everything less than a pulse behind
/// it.
void SpinningLidar::read(std::size_t beam, std::uint64_t number, LidarScan& out) const {
  const RTCRayHit8& packet = impl_->packets[beam];
  std::vector<Echo>& echoes = impl_->echoes;
  echoes.clear();
  std::size_t last_body = surfaces_.bodies();
  double albedo = 0;
  for (std::size_t k = 0; k < kRays; ++k) {
    if (packet.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID) continue;
    const Eigen::Vector3d d =
        Eigen::Vector3f(packet.ray.dir_x[k], packet.ray.dir_y[k], packet.ray.dir_z[k]).cast<double>();
    const Eigen::Vector3d o =
        Eigen::Vector3f(packet.ray.org_x[k], packet.ray.org_y[k], packet.ray.org_z[k]).cast<double>();
    const Eigen::Vector3d n =
        Eigen::Vector3f(packet.hit.Ng_x[k], packet.hit.Ng_y[k], packet.hit.Ng_z[k]).cast<double>();
    const auto range = static_cast<double>(packet.ray.tfar[k]);
    const std::size_t body = surfaces_.body_of(
        surfaces_.triangle(packet.hit.instID[0][k], packet.hit.geomID[k], packet.hit.primID[k]));
    // An instance's normal is in its body's frame.
    const bool placed = packet.hit.instID[0][k] != RTC_INVALID_GEOMETRY_ID;
    const double squareness =
        std::abs(n.normalized().dot(placed ? Eigen::Vector3d(surfaces_.X_BW(body).linear() * d) : d));
    if (body != last_body) {  // the beam's rays lie within its footprint
      const double footprint = 2 * (options_.beam_radius + range * options_.beam_angle);
      const Eigen::Vector3f p_B = (surfaces_.X_BW(body) * (o + range * d)).cast<float>();
      const auto size = static_cast<float>(footprint);
      float share = 0;
      surfaces_.pattern().albedos(body, {{&p_B[0], 1}, {&p_B[1], 1}, {&p_B[2], 1}, {&size, 1}}, {&share, 1});
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
