#pragma once

#include <cstdint>
#include <span>

#include "sensors/random_stream.h"

namespace walkman::sensors {

/// Value below which a standard normal variable lies with probability `p`, 0 < p < 1.
[[nodiscard]] double normal_quantile(double p);

/// Fills `out` with independent normally distributed values of mean 0 and variance 1, a function of the
/// stream alone.
///
/// Each is the sum of two draws from 2048 equally likely quantiles, within ±4.9: unlike a method with
/// logarithms, it costs only a few clock cycles per value.
void fill_normal(const RandomStream& stream, std::span<float> out);

/// The same from 32 independent random bits for each value.
void fill_normal(std::span<const std::uint32_t> bits, std::span<float> out);

/// The same in half the time from 2048 equally likely values within ±3.6: for values that are coarsely
/// rounded afterwards.
void fill_coarse_normal(const RandomStream& stream, std::span<float> out);

}  // namespace walkman::sensors
