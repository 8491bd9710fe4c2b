#include "urdf/reader/text_file.h"

#include <fstream>
#include <stdexcept>
#include <system_error>

#include <fmt/format.h>

namespace walkman {

std::string read_text_file(const std::filesystem::path& file, std::size_t max_bytes) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status))
    throw std::runtime_error(fmt::format("{}: no such file", file.string()));
  if (!std::filesystem::is_regular_file(status))
    throw std::runtime_error(fmt::format("{}: not a regular file", file.string()));
  const auto size = std::filesystem::file_size(file, error);
  if (error) throw std::runtime_error(fmt::format("{}: {}", file.string(), error.message()));
  if (size == 0) throw std::runtime_error(fmt::format("{}: the file is empty", file.string()));
  if (size > max_bytes)
    throw std::runtime_error(
        fmt::format("{}: {} bytes, expected at most {}", file.string(), size, max_bytes));

  std::string text(static_cast<std::size_t>(size), '\0');
  std::ifstream stream(file, std::ios::binary);
  if (!stream.read(text.data(), static_cast<std::streamsize>(text.size())))
    throw std::runtime_error(fmt::format("{}: cannot be read", file.string()));
  return text;
}

}  // namespace walkman
