#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "drivers/camera/multisense/camera.h"
#include "drivers/camera/multisense/sweep.h"

namespace walkman::apps {

/// Writes the frame from which `cloud` was made, as its client received it, into `folder`: cloud.pcd
/// (organized, binary, left optical frame, m), cloud.ply (the valid points, with the left image's intensity),
/// left.png, right.png, disparity.png (colours from blue, far, to red, near; black: no match), depth.png (16
/// bits, mm, 0: no match). Returns the files' names. Throws std::runtime_error with the file that cannot be
/// written.
[[nodiscard]] std::vector<std::string> write_captured(const std::filesystem::path& folder,
                                                      const multisense::Camera& camera,
                                                      const camera::OrganizedCloud& cloud);

/// Writes a sweep of the laser in the left optical frame: sweep.pcd, sweep.ply with intensity (device units),
/// sweep.png, seen from above and behind the head, coloured by height. `up_C`: unit vector. Returns and
/// throws as above.
[[nodiscard]] std::vector<std::string> write_sweep(const std::filesystem::path& folder,
                                                   const std::vector<multisense::Sweep::Point>& sweep,
                                                   const Eigen::Vector3d& up_C);

}  // namespace walkman::apps
