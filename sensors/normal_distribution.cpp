#include "sensors/normal_distribution.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

namespace walkman::sensors {
namespace {

constexpr unsigned kTableBits = 11;
constexpr std::uint64_t kTableMask = (1U << kTableBits) - 1;
using Table = std::array<float, 1U << kTableBits>;

/// Quantiles at the centres of equal shares, scaled to `variance`.
Table make_table(double variance) {
  std::array<double, 1U << kTableBits> quantiles{};
  double square = 0;
  for (std::size_t i = 0; i < quantiles.size(); ++i) {
    quantiles[i] = normal_quantile((static_cast<double>(i) + 0.5) / static_cast<double>(quantiles.size()));
    square += quantiles[i] * quantiles[i];
  }
  const double scale = std::sqrt(variance * static_cast<double>(quantiles.size()) / square);
  Table table{};
  for (std::size_t i = 0; i < quantiles.size(); ++i) table[i] = static_cast<float>(scale * quantiles[i]);
  return table;
}

/// For each of two values that are added.
const Table& halves() {
  static const Table table = make_table(0.5);
  return table;
}

}  // namespace

double normal_quantile(double p) {
  const auto below = [](double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); };
  double lower = -40;
  double upper = 40;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (lower + upper);
    (below(middle) < p ? lower : upper) = middle;
  }
  return 0.5 * (lower + upper);
}

void fill_normal(const RandomStream& stream, std::span<float> out) {
  const Table& table = halves();
  const auto pair_sum = [&table](std::uint64_t bits) {
    return table[bits & kTableMask] + table[(bits >> kTableBits) & kTableMask];
  };
  std::size_t i = 0;
  for (; i + 1 < out.size(); i += 2) {
    const std::uint64_t bits = stream.bits(i / 2);
    out[i] = pair_sum(bits);
    out[i + 1] = pair_sum(bits >> 32);
  }
  if (i < out.size()) out[i] = pair_sum(stream.bits(i / 2));
}

void fill_normal(std::span<const std::uint32_t> bits, std::span<float> out) {
  const Table& table = halves();
  for (std::size_t i = 0; i < bits.size(); ++i)
    out[i] = table[bits[i] & kTableMask] + table[(bits[i] >> kTableBits) & kTableMask];
}

void fill_coarse_normal(const RandomStream& stream, std::span<float> out) {
  static const Table table = make_table(1);
  constexpr unsigned kStep = 64 / 4;
  const std::size_t whole = out.size() / 4 * 4;
  for (std::size_t i = 0; i < whole; i += 4) {
    const std::uint64_t bits = stream.bits(i / 4);
    for (unsigned k = 0; k < 4; ++k) out[i + k] = table[(bits >> (k * kStep)) & kTableMask];
  }
  for (std::size_t i = whole; i < out.size(); ++i)
    out[i] = table[(stream.bits(i / 4) >> (i % 4 * kStep)) & kTableMask];
}

}  // namespace walkman::sensors
