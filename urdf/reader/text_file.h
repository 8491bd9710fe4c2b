#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace walkman {

/// Throws std::runtime_error with the file and what is wrong unless it is there and a regular file: a folder,
/// a FIFO (which might never end, nor even open) or a device is none.
void require_regular_file(const std::filesystem::path& file);

/// The same for a file to be written: it may be missing, but what is there must be a regular file.
void require_regular_output(const std::filesystem::path& file);

/// Whole contents of a regular file of 1..`max_bytes` bytes, as they are.
/// Throws std::runtime_error with the file and what is wrong: not there, not a file, empty, too large.
[[nodiscard]] std::string read_file(const std::filesystem::path& file, std::size_t max_bytes);

/// The same for text: throws with the line, too, where it is not UTF-8.
[[nodiscard]] std::string read_text_file(const std::filesystem::path& file, std::size_t max_bytes);

}  // namespace walkman
