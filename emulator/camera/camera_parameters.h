#pragma once

#include <filesystem>

#include "sensors/spinning_lidar.h"
#include "sensors/stereo_camera.h"

namespace walkman {

/// Errors of the inertial unit in a camera's head: noise densities and largest offsets of its three chips.
struct ImuErrors {
  double force_noise = 220e-6, force_offset = 0.02;  ///< g/√Hz, g
  double rate_noise = 0.03, rate_offset = 1;         ///< °/s/√Hz, °/s
  double field_noise = 0.002, field_offset = 0.02;   ///< gauss per sample, gauss
};

/// Optics and errors of an emulated camera.
struct CameraParameters {
  sensors::StereoOptions stereo;
  double rate_hz = 15;  ///< frames per second
  sensors::LidarOptions laser;
  ImuErrors imu;

  /// The same camera without errors: exact disparities and ranges.
  [[nodiscard]] CameraParameters noise_free() const;
};

/// Reads a file such as multisense.yaml, which must contain every key. Throws std::runtime_error: one
/// sentence with file, line, key, what was found and what was expected.
[[nodiscard]] CameraParameters load_camera_parameters(const std::filesystem::path& yaml_file);

}  // namespace walkman
