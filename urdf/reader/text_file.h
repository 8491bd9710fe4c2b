#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace walkman {

/// Whole contents of a regular file of 1..`max_bytes` bytes.
/// Throws std::runtime_error with the file and what is wrong: not there, not a file, empty, too large.
[[nodiscard]] std::string read_text_file(const std::filesystem::path& file, std::size_t max_bytes);

}  // namespace walkman
