#pragma once

#include <filesystem>

#include "sensors/spinning_lidar.h"
#include "sensors/stereo_camera.h"

namespace walkman {

/// Optics and errors of an emulated camera.
struct CameraParameters {
  sensors::StereoOptions stereo;
  double rate_hz = 15;  ///< frames a second
  sensors::LidarOptions laser;

  /// The same camera without errors: exact disparities and ranges.
  [[nodiscard]] CameraParameters noise_free() const;
};

/// Reads a file such as multisense.yaml, in which every key has to be. Throws std::runtime_error: one
/// sentence with file, line, key, what was found and what was expected.
[[nodiscard]] CameraParameters load_camera_parameters(const std::filesystem::path& yaml_file);

}  // namespace walkman
