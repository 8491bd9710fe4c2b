#pragma once

#include <filesystem>

namespace walkman::apps {

/// Where the product's data lies (robot, scenes, parameters): the folder in the environment variable
/// WALKMAN_DATA if set, else the tree the program was built from. Throws std::runtime_error naming the folder
/// if it has no `urdf/walkman.urdf`.
[[nodiscard]] std::filesystem::path data_directory();

}  // namespace walkman::apps
