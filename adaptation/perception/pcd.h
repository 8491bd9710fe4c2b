#pragma once

#include <filesystem>

#include "drivers/camera/range_camera.h"

namespace walkman::perception {

/// Reads a PCD file of version 0.7 or before: ascii, binary or compressed, organized or not, with x, y and z
/// as 4-byte floats among its fields, at most 2^26 points. Coordinates are in m in the frame of whatever took
/// the cloud; a point that is not finite is not a number in all three. Throws std::runtime_error with file,
/// line and reason for files that are missing, empty, truncated, damaged, foreign or no regular files.
[[nodiscard]] camera::OrganizedCloud read_pcd(const std::filesystem::path& file);

/// Writes a binary PCD (x y z, float32), organized. Throws std::runtime_error with the file when that cannot
/// be done.
void write_pcd(const std::filesystem::path& file, const camera::OrganizedCloud& cloud);

}  // namespace walkman::perception
