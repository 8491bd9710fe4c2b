#include "apps/shared/data_directory.h"

#include <cstdlib>
#include <stdexcept>

#include "urdf/reader/utf8.h"

namespace walkman::apps {
namespace {

bool has_data(const std::filesystem::path& folder) {
  return std::filesystem::exists(folder / "urdf" / "walkman.urdf");
}

/// An installed program's data: BIN/../share/walkman-hil.
std::filesystem::path installed_data() {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  return error ? std::filesystem::path() : program.parent_path().parent_path() / "share" / "walkman-hil";
}

}  // namespace

std::filesystem::path data_directory() {
  const char* set = std::getenv("WALKMAN_DATA");
  const std::filesystem::path installed = installed_data();
  std::filesystem::path folder = set != nullptr        ? set
                                 : has_data(installed) ? installed
                                                       : std::filesystem::path(WALKMAN_SOURCE_TREE);
  if (first_non_utf8(folder.string())) {
    throw std::runtime_error(folder.string() +
                             ": not UTF-8, expected a folder with a UTF-8 name for the product's data");
  }
  if (!has_data(folder)) {
    throw std::runtime_error(folder.string() +
                             ": no urdf/walkman.urdf here, expected the product's data (set WALKMAN_DATA)");
  }
  return folder;
}

}  // namespace walkman::apps
