#pragma once

#include <filesystem>

namespace walkman::apps {

/// Folder with the product's data (robot, scenes, parameters): the folder in the environment variable
/// WALKMAN_DATA if set; else share/walkman-hil beside the program's folder, if it was installed; else the
/// tree it was built from. Throws std::runtime_error naming the folder if it has no `urdf/walkman.urdf`.
[[nodiscard]] std::filesystem::path data_directory();

}  // namespace walkman::apps
