#pragma once

#include <filesystem>

#include "apps/picture/picture_renderer.h"

namespace walkman::picture {

/// Writes `picture` as a PNG (RGB, 8 bits, no time stamp: the same picture gives the same bytes).
/// Throws std::runtime_error naming the file if it cannot be written, std::invalid_argument if the pixels are
/// not width times height.
void write_png(const Picture& picture, const std::filesystem::path& file);

}  // namespace walkman::picture
