#pragma once

#include <filesystem>

#include <Eigen/Geometry>

#include "drivers/camera/range_camera.h"

namespace walkman::perception {

/// A cloud read from a file. F is the frame of the file's coordinates, C the sensor's frame.
struct RecordedCloud {
  camera::OrganizedCloud cloud;  ///< points in C
  Eigen::Isometry3d X_FC = Eigen::Isometry3d::Identity();
};

/// Reads a PCD file of version 0.7 or earlier: ASCII, binary or compressed, organized or not, with x, y and z
/// as 4-byte floats among its fields, and at most 2^26 points. Coordinates are in m; a point with a
/// non-finite coordinate becomes NaN in all three. VIEWPOINT is the sensor's pose in the frame of the
/// coordinates (position, and quaternion w x y z of its optical axes: x right, y down, z forward), as PCL's
/// normal estimation interprets it (PointCloudLibrary/pcl#6279). PCL's own grabbers and viewer assume that
/// the coordinates are already in the sensor's frame; in an organized cloud the straight lines of the pixels'
/// rays reveal this, and C is then F. Throws std::runtime_error with file, line and reason if the file is
/// missing, empty, truncated, damaged, of another format or not a regular file.
[[nodiscard]] RecordedCloud read_pcd(const std::filesystem::path& file);

/// Writes an organized binary PCD file (x y z, float32). Throws std::runtime_error with the file name on
/// failure.
void write_pcd(const std::filesystem::path& file, const camera::OrganizedCloud& cloud);

}  // namespace walkman::perception
