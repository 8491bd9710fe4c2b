#include "apps/picture/png_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>

#include <png.h>

namespace walkman::picture {
namespace {

void write(int width, int height, png_uint_32 format, const void* pixels, std::size_t count,
           const std::filesystem::path& file) {
  if (width < 1 || height < 1 ||
      count != static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    throw std::invalid_argument("a picture of " + std::to_string(width) + "x" + std::to_string(height) +
                                " px with " + std::to_string(count) + " pixels");
  }
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = format;
  std::string bytes(PNG_IMAGE_PNG_SIZE_MAX(image), '\0');
  png_alloc_size_t size = bytes.size();
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, pixels, 0, nullptr) == 0) {
    throw std::runtime_error(std::string("libpng: ") + image.message);
  }
  bytes.resize(size);
  std::ofstream out(file, std::ios::binary);
  out << bytes;
  out.close();
  if (!out) throw std::runtime_error(file.string() + ": cannot be written: " + std::strerror(errno));
}

}  // namespace

void write_png(const Picture& picture, const std::filesystem::path& file) {
  static_assert(sizeof(picture.pixels[0]) == 3);
  write(picture.width, picture.height, PNG_FORMAT_RGB, picture.pixels.data(), picture.pixels.size(), file);
}

void write_grey_png(int width, int height, std::span<const std::uint8_t> pixels,
                    const std::filesystem::path& file) {
  write(width, height, PNG_FORMAT_GRAY, pixels.data(), pixels.size(), file);
}

void write_grey_png(int width, int height, std::span<const std::uint16_t> pixels,
                    const std::filesystem::path& file) {
  write(width, height, PNG_FORMAT_LINEAR_Y, pixels.data(), pixels.size(), file);
}

}  // namespace walkman::picture
