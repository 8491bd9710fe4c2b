#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "adaptation/parameters.h"
#include "drivers/camera/range_camera.h"

namespace walkman::perception {

/// A plane n·p + d = 0 in the cloud's frame; n is a unit vector towards the sensor.
struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double offset = 0;
  std::vector<Eigen::Vector3d> hull;  ///< convex hull of the inliers, in the plane, counter-clockwise about n
};

/// A handle: co-linear cylinders refined to one. A grasp may sit anywhere in [from, to] along the axis.
struct Handle {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< point of the axis midway between the ends, m
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();   ///< unit vector, to the right (along +x of the camera)
  double radius = 0;                                 ///< m
  double from = 0, to = 0;                           ///< ends along the axis from the centre, m
  double reach = 0;  ///< what a shell stands for to both sides of its place, m
  /// Axial positions (m from the centre) of the shells that make the handle, sorted. Stretches between the
  /// ends that no shell reaches have no free gap around them (a weight sits there): no grasp there.
  std::vector<double> places;

  /// The position nearest to `along` (m from the centre) that is between the ends and within reach of a
  /// shell.
  [[nodiscard]] double nearest_graspable(double along) const;
};

/// A grasp frame C_f (paper, sec. 3.1): x along the handle to the right, y the plane's normal, z towards the
/// sensor; origin on the object's surface above the handle's axis. y is n_p made square to x. For a handle
/// that stands on the plane (axis within 5° of n_p) z is the direction to the sensor made square to x
/// instead, and y = z × x.
struct GraspFrame {
  Eigen::Isometry3d X_CG = Eigen::Isometry3d::Identity();  ///< in the cloud's frame
  int handle = -1;
  double along = 0;  ///< position on the handle's axis from its centre, m
};

struct StepTime {
  std::string step;
  double seconds = 0;
};

struct StageOneResult {
  Plane plane;
  std::vector<std::size_t> cluster_sizes;         ///< points, largest first
  std::vector<Eigen::Vector3f> object;            ///< points of the largest cluster, smoothed
  Eigen::Vector3d com = Eigen::Vector3d::Zero();  ///< visual centre of mass
  std::vector<Handle> handles;
  std::optional<GraspFrame> grasp;  ///< nearest handle place to the CoM; none without handles
  std::vector<StepTime> times;
};

/// Stage I cannot say where to grasp; what() is one sentence for people.
class NotLocated : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Runs Stage I (paper, sec. 3.1, steps I.1 to I.6). The sensor is at the origin of the cloud's frame. An
/// unorganized cloud (height 1) works too. The result is the same for every number of threads. Throws
/// NotLocated when there is no finite point in reach, no plane, or nothing above it.
[[nodiscard]] StageOneResult locate(const camera::OrganizedCloud& cloud,
                                    const StageOneParameters& parameters);

/// The grasp frame on `handle` at the axial position `along`, clamped to the handle's ends, for Stage II's
/// regrasp. Throws std::out_of_range for a handle that is not there.
[[nodiscard]] GraspFrame grasp_frame_at(const StageOneResult& result, int handle, double along);

}  // namespace walkman::perception
