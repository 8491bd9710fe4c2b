#include "apps/data_directory.h"

#include <cstdlib>
#include <stdexcept>

namespace walkman::apps {

std::filesystem::path data_directory() {
  const char* set = std::getenv("WALKMAN_DATA");
  const std::filesystem::path folder = set != nullptr ? set : WALKMAN_SOURCE_TREE;
  if (!std::filesystem::exists(folder / "urdf" / "walkman.urdf")) {
    throw std::runtime_error(folder.string() +
                             ": no urdf/walkman.urdf here, expected the product's data (set WALKMAN_DATA)");
  }
  return folder;
}

}  // namespace walkman::apps
