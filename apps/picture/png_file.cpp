#include "apps/picture/png_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>

#include <png.h>

namespace walkman::picture {
namespace {

/// The picture in PNG's form, in memory.
std::string encoded(const Picture& picture) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB;
  std::string bytes(PNG_IMAGE_PNG_SIZE_MAX(image), '\0');
  png_alloc_size_t size = bytes.size();
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, picture.pixels.data(), 0, nullptr) == 0) {
    throw std::runtime_error(std::string("libpng: ") + image.message);
  }
  bytes.resize(size);
  return bytes;
}

}  // namespace

void write_png(const Picture& picture, const std::filesystem::path& file) {
  static_assert(sizeof(picture.pixels[0]) == 3);
  if (picture.width < 1 || picture.height < 1 ||
      picture.pixels.size() !=
          static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height)) {
    throw std::invalid_argument("a picture of " + std::to_string(picture.width) + "x" +
                                std::to_string(picture.height) + " px with " +
                                std::to_string(picture.pixels.size()) + " pixels");
  }
  const std::string bytes = encoded(picture);
  std::ofstream out(file, std::ios::binary);
  out << bytes;
  out.close();
  if (!out) throw std::runtime_error(file.string() + ": cannot be written: " + std::strerror(errno));
}

}  // namespace walkman::picture
