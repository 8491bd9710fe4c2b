#pragma once

#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "adaptation/parameters.h"
#include "adaptation/perception/image_border.h"
#include "adaptation/perception/sampling.h"
#include "drivers/camera/range_camera.h"

namespace walkman::perception {

// Frame C, throughout this namespace: the cloud's frame, with the sensor at its origin. For the robot's
// camera it is the left optical frame (multisense/left_camera_optical_frame): z along the line of sight, x
// right, y down.

/// The plane n_C · p_CP + offset = 0.
struct Plane {
  Eigen::Vector3d n_C = Eigen::Vector3d::UnitZ();  ///< unit normal, towards the sensor
  double offset = 0;                               ///< distance from the sensor, m
  /// Corners of the inliers' convex hull, in the plane, counter-clockwise about n_C, m.
  std::vector<Eigen::Vector3d> hull_C;
};

/// A handle: collinear cylinders merged and refined (paper, sec. 2.1). A grasp may lie anywhere in [from, to]
/// along the axis where a hand has room around it.
struct Handle {
  Eigen::Vector3d p_CM = Eigen::Vector3d::Zero();     ///< midpoint of the axis between its two ends, m
  Eigen::Vector3d axis_C = Eigen::Vector3d::UnitX();  ///< unit vector, to the right (towards +x of C)
  double radius = 0;                                  ///< m
  double from = 0, to = 0;                            ///< ends along the axis, from M, m
  double reach = 0;  ///< stretch of the axis, to either side, that a place represents, m
  /// Axial positions (m from M) with surface and a free gap around it, sorted. Stretches out of reach of all
  /// of them have no such gap (a weight sits there) and cannot be grasped.
  std::vector<double> places;

  double residual = 0;            ///< standard deviation of the points across its surface, m
  double arc = 0;                 ///< angle about the axis over which it is seen, rad
  double radius_deviation = 0;    ///< standard deviation, m
  double position_deviation = 0;  ///< of M across the axis, in its worse direction, m
  double axis_deviation = 0;      ///< of the axis, in its worse direction, rad

  /// Returns the position nearest to `along` (both m from M) that lies between the ends and within reach of a
  /// place.
  [[nodiscard]] double nearest_graspable(double along) const;
};

/// The paper's grasp frame C_f (sec. 3.1), here G: x along the handle to the right, y along the plane's
/// normal, z towards the sensor; origin on the object's surface above the handle's axis. y is n_p made
/// perpendicular to x. For a handle that stands on the plane (axis within 5° of n_p), z is instead the
/// direction to the sensor made perpendicular to x, and y = z × x.
struct GraspFrame {
  Eigen::Isometry3d X_CG = Eigen::Isometry3d::Identity();
  int handle = -1;   ///< index of its handle
  double along = 0;  ///< position on the handle's axis from M, m
};

struct StepTime {
  std::string step;
  double seconds = 0;
};

/// A cluster of points on the plane, with its evaluation.
struct SeenObject {
  std::size_t points = 0;                           ///< number of points of the cloud
  std::vector<Eigen::Vector3f> surface_C;           ///< smoothed, m
  Eigen::Vector3d p_CCm = Eigen::Vector3d::Zero();  ///< visual centre of mass, m
  std::vector<Handle> handles;                      ///< longest first
  /// Handle-like, but too thin or too thick for the hand, or not certain to fit it.
  std::vector<Handle> refused;
  bool cut_by_image = false;  ///< continues beyond the image's border
  ImageMargins to_border;
};

struct StageOneResult {
  Sampling sampling;
  Plane plane;
  std::vector<SeenObject> objects;  ///< every cluster, most points first
  std::size_t chosen = 0;           ///< index of the object to be grasped
  double distance_asked = 0;        ///< of its nearest point from the requested point, m; 0 if there was none
  std::optional<GraspFrame> grasp;  ///< handle place nearest to the chosen object's CoM; none without handles
  std::vector<StepTime> times;      ///< by the host's clock

  [[nodiscard]] const SeenObject& object() const { return objects[chosen]; }
};

/// Stage I cannot determine where to grasp; what() is one human-readable sentence.
class NotLocated : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Runs Stage I (paper, sec. 3.1, steps I.1 to I.6), evaluating every cluster. Also accepts an unorganized
/// cloud (height 1).
///
/// Chooses the cluster with a point next to `near_C`, if that is given; otherwise the largest cluster (step
/// I.3) that has a handle, or the largest of all if none has one: walls, shelves and boxes are clusters, too.
/// If the objects on the dominant plane have no handle but contain a plane that would itself be dominant (a
/// table in front of a wall, the top of a box), the search is repeated with that plane.
///
/// Throws NotLocated if there is no finite point within reach, no plane, no object on it, or none within
/// `asked_distance` of `near_C`; std::invalid_argument if the cloud's sizes are inconsistent.
///
/// `elsewhere_C`: points of the same scene seen from elsewhere (m, in C). They are added to the objects;
/// plane, sampling and image border are those of the cloud.
[[nodiscard]] StageOneResult locate(const camera::OrganizedCloud& cloud, const StageOneParameters& parameters,
                                    const std::optional<Eigen::Vector3d>& near_C = std::nullopt,
                                    std::span<const Eigen::Vector3f> elsewhere_C = {});

/// Returns the grasp frame at the place on the chosen object's handles that is nearest to its visual centre
/// of mass; nullopt without handles.
[[nodiscard]] std::optional<GraspFrame> nearest_grasp(const StageOneResult& result);

/// Returns the grasp frame on the chosen object's `handle` at the axial position `along` (m from M), clamped
/// to the handle's ends, for Stage II's regrasp. Throws std::out_of_range if there is no such handle.
[[nodiscard]] GraspFrame grasp_frame_at(const StageOneResult& result, int handle, double along);

}  // namespace walkman::perception
