#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace walkman {

/// Throws std::runtime_error with the file and the problem unless it exists and is a regular file, not a
/// folder, a FIFO (which might never end, or never even open) or a device.
void require_regular_file(const std::filesystem::path& file);

/// The same for a file to be written: it may be missing, but if it exists it must be a regular file.
void require_regular_output(const std::filesystem::path& file);

/// Returns the whole, unmodified contents of a regular file of 1..`max_bytes` bytes.
/// Throws std::runtime_error with the file and the problem: missing, not a file, empty, too large.
[[nodiscard]] std::string read_file(const std::filesystem::path& file, std::size_t max_bytes);

/// The same for text: also throws, with the line, if it is not UTF-8.
[[nodiscard]] std::string read_text_file(const std::filesystem::path& file, std::size_t max_bytes);

}  // namespace walkman
