#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "urdf/reader/robot_model.h"

namespace walkman::sensors {

/// Triangles with shared vertices, counter-clockwise seen from outside.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;  ///< m
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Largest distance between a curved surface and its triangles, m: a sixtieth of the camera's noise at 1 m.
/// Holds up to a radius of 2.1 m for cylinders and 0.41 m for spheres; beyond that the number of segments is
/// at its limit.
inline constexpr double kChordTolerance = 8e-5;

/// Number of segments, a multiple of 4 in 12..`most`, with which a regular polygon stays within ±`tolerance`
/// (m) of a circle of `radius` (m), if its vertices lie as far outside the circle as its edges dip inside.
[[nodiscard]] int circle_segments(double radius, double tolerance, int most);

/// Appends the closed surface of `geometry`, whose link has the pose X_FL in frame F; the vertices are in F.
/// Throws std::invalid_argument naming the geometry if a size is not positive and finite, a vertex is not
/// finite or a mesh's triangle refers to a vertex that does not exist.
void append_triangles(const LinkGeometry& geometry, const Eigen::Isometry3d& X_FL, TriangleMesh& mesh);

}  // namespace walkman::sensors
