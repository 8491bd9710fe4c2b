#pragma once

#include <filesystem>

#include <Eigen/Geometry>

#include "drivers/camera/range_camera.h"

namespace walkman::perception {

/// A cloud from a file. F is the frame of the file's coordinates, C the sensor's.
struct RecordedCloud {
  camera::OrganizedCloud cloud;  ///< points in C
  Eigen::Isometry3d X_FC = Eigen::Isometry3d::Identity();
};

/// Reads a PCD file of version 0.7 or before: ascii, binary or compressed, organized or not, with x, y and z
/// as 4-byte floats among its fields, at most 2^26 points. Coordinates are in m; a point that is not finite
/// is not a number in all three. VIEWPOINT is the sensor's pose in the frame of the coordinates (position,
/// and quaternion w x y z of its optical axes: x right, y down, z forward), as PCL's normal estimation reads
/// it (PointCloudLibrary/pcl#6279). PCL's own grabbers and viewer take the coordinates to be the sensor's
/// already; an organized cloud shows by the straight lines of its pixels' rays that they are, and C is then
/// F. Throws std::runtime_error with file, line and reason for files that are missing, empty, truncated,
/// damaged, foreign or no regular files.
[[nodiscard]] RecordedCloud read_pcd(const std::filesystem::path& file);

/// Writes a binary PCD (x y z, float32), organized. Throws std::runtime_error with the file when that cannot
/// be done.
void write_pcd(const std::filesystem::path& file, const camera::OrganizedCloud& cloud);

}  // namespace walkman::perception
