#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace walkman::perception {

/// What the header of a PCD file (version 0.7 and before) promises.
struct PcdHeader {
  std::size_t width = 0, height = 0, points = 0;
  std::size_t point_bytes = 0;  ///< of one point in a binary body
  std::size_t body_offset = 0;  ///< of the body's first byte in the file
  std::string data;             ///< "ascii", "binary" or "binary_compressed"
};

/// Reads and checks a header, before anything is allocated by what it says: x, y and z as 4-byte floats,
/// width × height = points, at most 2^26 points, and a body as long as promised. Throws std::runtime_error
/// with file, line and reason.
[[nodiscard]] PcdHeader read_pcd_header(const std::filesystem::path& file);

}  // namespace walkman::perception
