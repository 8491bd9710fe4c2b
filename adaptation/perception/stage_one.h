#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "adaptation/parameters.h"
#include "drivers/camera/range_camera.h"

namespace walkman::perception {

// Frame C, in the whole room: the cloud's, with the sensor at its origin. For the robot's camera it is the
// left optical frame (multisense/left_camera_optical_frame): z along the line of sight, x right, y down.

/// The plane n_C · p_CP + offset = 0.
struct Plane {
  Eigen::Vector3d n_C = Eigen::Vector3d::UnitZ();  ///< unit normal, towards the sensor
  double offset = 0;                               ///< distance from the sensor, m
  /// Corners of the inliers' convex hull, in the plane, counter-clockwise about n_C, m.
  std::vector<Eigen::Vector3d> hull_C;
};

/// A handle: co-linear cylinders refined to one (paper, sec. 2.1). A grasp may sit anywhere in [from, to]
/// along the axis where a cylindrical shell was found.
struct Handle {
  Eigen::Vector3d p_CM = Eigen::Vector3d::Zero();     ///< midpoint of the axis between its two ends, m
  Eigen::Vector3d axis_C = Eigen::Vector3d::UnitX();  ///< unit vector, to the right (towards +x of C)
  double radius = 0;                                  ///< m
  double from = 0, to = 0;                            ///< the ends along the axis from M, m
  double reach = 0;  ///< what a shell stands for to both sides of its place, m
  /// Axial positions (m from M) of the shells that make the handle, sorted. Stretches that no shell reaches
  /// have no free gap around them (a weight sits there): no grasp there.
  std::vector<double> places;

  /// The position nearest to `along` (both m from M) that is between the ends and within reach of a shell.
  [[nodiscard]] double nearest_graspable(double along) const;
};

/// A grasp frame C_f of the paper (sec. 3.1), here G: x along the handle to the right, y the plane's normal,
/// z towards the sensor; origin on the object's surface above the handle's axis. y is n_p made square to x.
/// For a handle that stands on the plane (axis within 5° of n_p) z is the direction to the sensor made square
/// to x instead, and y = z × x.
struct GraspFrame {
  Eigen::Isometry3d X_CG = Eigen::Isometry3d::Identity();
  int handle = -1;   ///< index of its handle
  double along = 0;  ///< position on the handle's axis from M, m
};

struct StepTime {
  std::string step;
  double seconds = 0;
};

struct StageOneResult {
  Plane plane;
  std::vector<std::size_t> cluster_sizes;           ///< points, largest first
  std::vector<Eigen::Vector3f> object_C;            ///< points of the largest cluster, smoothed, m
  Eigen::Vector3d p_CCm = Eigen::Vector3d::Zero();  ///< visual centre of mass, m
  std::vector<Handle> handles;
  std::optional<GraspFrame> grasp;  ///< nearest handle place to the CoM; none without handles
  std::vector<StepTime> times;      ///< of the host's clock
};

/// Stage I cannot say where to grasp; what() is one sentence for people.
class NotLocated : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Runs Stage I (paper, sec. 3.1, steps I.1 to I.6). An unorganized cloud (height 1) works too. Throws
/// NotLocated when the cloud's sizes contradict each other, when there is no finite point in reach, no plane,
/// or no object on it.
[[nodiscard]] StageOneResult locate(const camera::OrganizedCloud& cloud,
                                    const StageOneParameters& parameters);

/// The grasp frame on `handle` at the axial position `along` (m from M), clamped to the handle's ends, for
/// Stage II's regrasp. Throws std::out_of_range for a handle that is not there.
[[nodiscard]] GraspFrame grasp_frame_at(const StageOneResult& result, int handle, double along);

}  // namespace walkman::perception
