#include "emulator/scene/draws.h"

#include <cmath>
#include <numbers>

namespace walkman {
namespace {

constexpr std::uint64_t kStep = 0x9E3779B97F4A7C15U;

std::uint64_t mixed(std::uint64_t z) {
  z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
  z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
  return z ^ (z >> 31U);
}

/// FNV-1a, followed by a byte that occurs in no text.
std::uint64_t hashed(std::uint64_t hash, std::string_view text) {
  for (const char c : text) hash = (hash ^ static_cast<std::uint8_t>(c)) * 0x100000001B3U;
  return (hash ^ 0xFFU) * 0x100000001B3U;
}

}  // namespace

Draws::Draws(std::uint64_t seed, std::string_view quantity, std::string_view part)
    : state_(mixed(mixed(seed + kStep) ^ hashed(hashed(0xCBF29CE484222325U, quantity), part))) {}

std::uint64_t Draws::bits() {
  state_ += kStep;
  return mixed(state_);
}

double Draws::symmetric() { return static_cast<double>(bits() >> 11U) * 0x1p-52 - 1.0; }

double Draws::uniform() { return static_cast<double>(bits() >> 11U) * 0x1p-53; }

double Draws::normal() {
  // Box and Muller 1958; the second of its two values is discarded.
  const double radius = std::sqrt(-2 * std::log(1 - uniform()));
  return radius * std::cos(2 * std::numbers::pi * uniform());
}

}  // namespace walkman
