#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "apps/picture/picture_renderer.h"

namespace walkman::picture {

/// Writes `picture` as a PNG (RGB, 8 bits, no time stamp: the same picture gives the same bytes).
/// Throws std::runtime_error naming the file if it cannot be written, std::invalid_argument if the pixels are
/// not width times height.
void write_png(const Picture& picture, const std::filesystem::path& file);
/// The same for an image of one channel, with its values unchanged: 8 bits, or 16 (linear).
void write_grey_png(int width, int height, std::span<const std::uint8_t> pixels,
                    const std::filesystem::path& file);
void write_grey_png(int width, int height, std::span<const std::uint16_t> pixels,
                    const std::filesystem::path& file);

}  // namespace walkman::picture
