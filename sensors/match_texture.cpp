#include "sensors/match_texture.h"

#include <algorithm>
#include <bit>

#include "sensors/normal_distribution.h"
#include "sensors/random_stream.h"

namespace walkman::sensors {
namespace {

enum TextureTerm : std::uint64_t { kNoSurface = 32, kBody };

// Makes coordinates positive, so that rounding towards zero rounds down.
constexpr float kCells = 1 << 17;
// Cells of a quarter to half a pixel, so that no two pixels share one; a power of two per metre, so that they
// stay in place while the camera approaches.
constexpr float kCellsPerPixel = 4;
constexpr float kCellsPerPatch = 12;  // along each axis
constexpr std::uint32_t kExponent = 0x7F800000;

/// 32 bits of a cell. The mixing is lowbias32 (Wellons, hash-prospector).
std::uint32_t bits_of(std::uint32_t x, std::uint32_t y, std::uint32_t z, std::uint32_t key) {
  std::uint32_t h = x * 0x9E3779B1U + y * 0x85EBCA77U + z * 0xC2B2AE3DU + key;
  h = (h ^ (h >> 16)) * 0x7FEB352DU;
  h = (h ^ (h >> 15)) * 0x846CA68BU;
  return h ^ (h >> 16);
}

}  // namespace

MatchTexture::MatchTexture(int width, int workers)
    : workers_(static_cast<std::size_t>(workers),
               {std::vector<std::uint32_t>(static_cast<std::size_t>(width)),
                std::vector<std::uint32_t>(static_cast<std::size_t>(width)),
                std::vector<float>(static_cast<std::size_t>(width))}) {}

void MatchTexture::row(int v, int worker_index, const SurfacePoints& points, const SurfacePattern& pattern,
                       std::span<float> error, std::span<float> rank, std::span<std::uint32_t> patch) {
  Worker& worker = workers_[static_cast<std::size_t>(worker_index)];
  const bool everywhere = points.count == error.size();
  if (!everywhere) {
    fill_normal(RandomStream(seed_, 0, kNoSurface, static_cast<std::uint64_t>(v)), error);
    std::fill(rank.begin(), rank.end(), 1.0F);
    std::fill(patch.begin(), patch.end(), 0U);
  }
  const auto values_for = [&](std::span<float> pixels) {
    return everywhere ? pixels : std::span(worker.values);
  };
  const auto scatter = [&](std::span<float> pixels) {
    if (everywhere) return;
    for (std::size_t i = 0; i < points.count; ++i)
      pixels[static_cast<std::size_t>(points.pixel[i])] = worker.values[i];
  };
  for (const SurfacePoints::Run& run : points.runs) {
    const RandomStream keys(seed_, 0, kBody, run.body);
    const auto key = static_cast<std::uint32_t>(keys.bits(0));
    const auto patch_key = static_cast<std::uint32_t>(keys.bits(1));
    const float *x = points.p_B[0].data(), *y = points.p_B[1].data(), *z = points.p_B[2].data();
    const float* const footprint = points.footprint.data();
    std::uint32_t* const bits = worker.bits.data();
    std::uint32_t* const patches = everywhere ? patch.data() : worker.patches.data();
    for (std::size_t i = run.first; i < run.end; ++i) {
      const float per_metre =
          std::bit_cast<float>(std::bit_cast<std::uint32_t>(kCellsPerPixel / footprint[i]) & kExponent);
      const auto cell = [](float p, float scale) {
        return static_cast<std::uint32_t>(static_cast<int>(p * scale + kCells));
      };
      const float patches_per_metre = per_metre * (1 / kCellsPerPatch);
      bits[i] = bits_of(cell(x[i], per_metre), cell(y[i], per_metre), cell(z[i], per_metre), key);
      patches[i] = bits_of(cell(x[i], patches_per_metre), cell(y[i], patches_per_metre),
                           cell(z[i], patches_per_metre), patch_key);
    }
  }
  if (!everywhere) {
    for (std::size_t i = 0; i < points.count; ++i)
      patch[static_cast<std::size_t>(points.pixel[i])] = worker.patches[i];
  }
  fill_normal(std::span<const std::uint32_t>(worker.bits).first(points.count), values_for(error));
  scatter(error);
  const std::span<float> ranks = values_for(rank);
  for (const SurfacePoints::Run& run : points.runs)
    pattern.ranks(run.body, points.on_body(run), ranks.subspan(run.first, run.end - run.first));
  scatter(rank);
}

}  // namespace walkman::sensors
