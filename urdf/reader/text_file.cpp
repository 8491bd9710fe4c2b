#include "urdf/reader/text_file.h"

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <system_error>

#include <fmt/format.h>

#include "urdf/reader/utf8.h"

namespace walkman {
namespace {

const char* kind_of(std::filesystem::file_type type) {
  switch (type) {
    case std::filesystem::file_type::directory:
      return "a folder";
    case std::filesystem::file_type::fifo:
      return "a FIFO";
    case std::filesystem::file_type::character:
    case std::filesystem::file_type::block:
      return "a device";
    case std::filesystem::file_type::socket:
      return "a socket";
    default:
      return "something else";
  }
}

void require_regular(const std::filesystem::path& file, const std::filesystem::file_status& status) {
  if (!std::filesystem::is_regular_file(status))
    throw std::runtime_error(
        fmt::format("{}: not a regular file but {}", file.string(), kind_of(status.type())));
}

}  // namespace

void require_regular_file(const std::filesystem::path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (status.type() == std::filesystem::file_type::not_found)
    throw std::runtime_error(fmt::format("{}: no such file", file.string()));
  if (error) throw std::runtime_error(fmt::format("{}: {}", file.string(), error.message()));
  require_regular(file, status);
}

void require_regular_output(const std::filesystem::path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (std::filesystem::exists(status)) require_regular(file, status);
}

std::string read_file(const std::filesystem::path& file, std::size_t max_bytes) {
  require_regular_file(file);
  std::error_code error;
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

std::string read_text_file(const std::filesystem::path& file, std::size_t max_bytes) {
  std::string text = read_file(file, max_bytes);
  if (const auto at = first_non_utf8(text)) {
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(*at), '\n');
    throw std::runtime_error(fmt::format("{}:{}: the byte {:02X}h is not UTF-8", file.string(), line,
                                         static_cast<unsigned char>(text[*at])));
  }
  return text;
}

}  // namespace walkman
