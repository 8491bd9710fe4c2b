#include "sensors/surface_pattern.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "sensors/random_stream.h"

namespace walkman::sensors {
namespace {

// Blurred by about a cell, grain is as fine as its cells; blotches are three times as wide as their cells, so
// that the cells do not show.
constexpr int kGrainBits = 6, kBlotchBits = 7;       // of the number of cells per side
constexpr float kBlotchCell = 0.004F;                // m
constexpr double kGrainBlur = 0.8, kBlotchBlur = 3;  // cells
constexpr double kMostShift = 1;                     // m, of a body's pattern along each axis

// Tones of painted and machined surfaces, from dark plastic to white paint; contrasts from a plain coat to
// wood grain.
constexpr float kDarkest = 0.18F, kBrightest = 0.75F;
constexpr float kLeastContrast = 0.04F, kMostContrast = 0.5F;
constexpr float kGrainShare = 0.7F;

/// Uniformly distributed rotation from three uniform numbers (Shoemake, Graphics Gems III, 1992).
Eigen::Quaterniond rotation_of(double a, double b, double c) {
  const double near = std::sqrt(1 - a), far = std::sqrt(a);
  const double turn = 2 * std::numbers::pi * b, other = 2 * std::numbers::pi * c;
  return {far * std::cos(other), near * std::sin(turn), near * std::cos(turn), far * std::sin(other)};
}

/// Probability that the grain at a random place of a random body has less contrast than `grain`: the product
/// of the body's contrast, log-uniform, and the strength in the blotch, uniform in 0..1.
float share_below(float grain) {
  const float span = std::log(kMostContrast / kLeastContrast);
  if (grain < kLeastContrast) return grain * (1 / kLeastContrast - 1 / kMostContrast) / span;
  return (std::log(grain / kLeastContrast) + 1 - grain / kMostContrast) / span;
}

}  // namespace

const PeriodicNoise& SurfacePattern::grain() {
  static const PeriodicNoise noise(kGrainBits, kGrain, kGrainBlur);
  return noise;
}

const PeriodicNoise& SurfacePattern::blotches() {
  static const PeriodicNoise noise(kBlotchBits, kBlotchCell, kBlotchBlur);
  return noise;
}

SurfacePattern::SurfacePattern(std::uint64_t seed, std::size_t bodies)
    : grain_(grain()), blotches_(blotches()) {
  for (std::size_t body = 0; body < bodies; ++body) {
    const RandomStream random(seed, 0, 0, body);
    Look look;
    look.base = kDarkest + (kBrightest - kDarkest) * random.uniform(0);
    look.contrast = kLeastContrast * std::pow(kMostContrast / kLeastContrast, random.uniform(1));
    const auto draw = [&](std::uint64_t i) { return static_cast<double>(random.uniform(i)); };
    look.X_PB = Eigen::Translation3d(kMostShift * Eigen::Vector3d(draw(2), draw(3), draw(4))) *
                rotation_of(draw(5), draw(6), draw(7));
    for (std::size_t level = 0; level <= kBlotchLevels; ++level)
      look.rank.at(level) = share_below(look.contrast * static_cast<float>(level) / kBlotchLevels);
    looks_.push_back(look);
  }
}

void SurfacePattern::ranks(std::size_t body, const Points& points, std::span<float> out) const {
  constexpr std::size_t kPart = 64;
  constexpr float kBetween = 1.0F / 4096;  // of a step between blotch levels
  const float* const rank = looks_[body].rank.data();
  std::array<int, kPart> blotch;
  for (std::size_t first = 0; first < out.size(); first += kPart) {
    const std::size_t count = std::min(kPart, out.size() - first);
    blotches_.find(points.x.subspan(first, count), points.y.subspan(first, count),
                   points.z.subspan(first, count), std::span(blotch).first(count));
    const float* const footprint = points.footprint.data() + first;
    for (std::size_t i = 0; i < count; ++i) {
      const auto cell = static_cast<std::uint32_t>(blotch[i]);
      const float between = kBetween * static_cast<float>(cell * 0x9E3779B1U >> 20);
      const float left = std::min(1.0F, kGrain / footprint[i]);
      const float level = left * (static_cast<float>(*(blotches_.values() + cell)) + between);
      const auto below = static_cast<int>(level);
      const float* const at = rank + below;
      out[first + i] = at[0] + (level - static_cast<float>(below)) * (at[1] - at[0]);
    }
  }
}

void SurfacePattern::albedos(std::size_t body, const Points& points, std::span<float> out) const {
  constexpr std::size_t kPart = 64;
  std::array<int, kPart> grain, blotch;
  std::array<float, kPart> grain_value, blotch_value;
  const Look& look = looks_[body];
  for (std::size_t first = 0; first < out.size(); first += kPart) {
    const std::size_t count = std::min(kPart, out.size() - first);
    const auto x = points.x.subspan(first, count), y = points.y.subspan(first, count),
               z = points.z.subspan(first, count);
    grain_.find(x, y, z, std::span(grain).first(count));
    blotches_.find(x, y, z, std::span(blotch).first(count));
    for (std::size_t i = 0; i < count; ++i) {
      grain_value[i] = static_cast<float>(*(grain_.values() + grain[i]));
      blotch_value[i] = static_cast<float>(*(blotches_.values() + blotch[i]));
    }
    const float* const footprint = points.footprint.data() + first;
    float* const to = out.data() + first;
    const float base = look.base, contrast = look.contrast;
    for (std::size_t i = 0; i < count; ++i) {
      const float fine = (grain_value[i] * (2.0F / 255) - 1) * std::min(1.0F, kGrain / footprint[i]);
      const float strength = blotch_value[i] * (1.0F / 255);
      const float tone =
          1 + contrast * (kGrainShare * strength * fine + (1 - kGrainShare) * (2 * strength - 1));
      to[i] = std::min(0.98F, std::max(0.02F, base * tone));
    }
  }
}

}  // namespace walkman::sensors
