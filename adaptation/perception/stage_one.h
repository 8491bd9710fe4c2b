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
/// along the axis where a hand finds room around it.
struct Handle {
  Eigen::Vector3d p_CM = Eigen::Vector3d::Zero();     ///< midpoint of the axis between its two ends, m
  Eigen::Vector3d axis_C = Eigen::Vector3d::UnitX();  ///< unit vector, to the right (towards +x of C)
  double radius = 0;                                  ///< m
  double from = 0, to = 0;                            ///< the ends along the axis from M, m
  double reach = 0;  ///< what a place stands for to both sides along the axis, m
  /// Axial positions (m from M) with surface and a free gap around it, sorted. Stretches out of reach of all
  /// of them have none (a weight sits there): no grasp there.
  std::vector<double> places;

  double residual = 0;            ///< standard deviation of the points across its surface, m
  double arc = 0;                 ///< angle about the axis over which it is seen, rad
  double radius_deviation = 0;    ///< standard deviation, m
  double position_deviation = 0;  ///< of M across the axis, in its worse direction, m
  double axis_deviation = 0;      ///< of the axis, in its worse direction, rad

  /// The position nearest to `along` (both m from M) that is between the ends and within reach of a place.
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

/// A cluster of points on the plane, judged.
struct SeenObject {
  std::size_t points = 0;                           ///< of the cloud
  std::vector<Eigen::Vector3f> surface_C;           ///< smoothed, m
  Eigen::Vector3d p_CCm = Eigen::Vector3d::Zero();  ///< visual centre of mass, m
  std::vector<Handle> handles;                      ///< longest first
  /// Handle-like, but too thin or too thick for the hand, or not certainly of its size.
  std::vector<Handle> refused;
  bool cut_by_image = false;  ///< goes on beyond the image's border
  ImageMargins to_border;
};

struct StageOneResult {
  Sampling sampling;
  Plane plane;
  std::vector<SeenObject> objects;  ///< every cluster, most points first
  std::size_t chosen = 0;           ///< the one to be grasped
  double distance_asked = 0;        ///< of its nearest point from the point asked for, m; 0 when none was
  std::optional<GraspFrame> grasp;  ///< nearest handle place to the chosen one's CoM; none without handles
  std::vector<StepTime> times;      ///< of the host's clock

  [[nodiscard]] const SeenObject& object() const { return objects[chosen]; }
};

/// Stage I cannot say where to grasp; what() is one sentence for people.
class NotLocated : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Runs Stage I (paper, sec. 3.1, steps I.1 to I.6), judging every cluster. An unorganized cloud (height 1)
/// works too.
///
/// Chosen is the cluster with a point next to `near_C`, where that is given. Otherwise it is the largest
/// cluster (step I.3) that has a handle, and the largest of all when none has: walls, shelves and boxes are
/// clusters, too. When what stands on the dominant plane has no handle, but holds a plane that would be
/// dominant itself (a table before a wall, the top of a box), the same is done with that.
///
/// Throws NotLocated when there is no finite point in reach, no plane, no object on it, or none within
/// `asked_distance` of `near_C`; std::invalid_argument when the cloud's sizes contradict each other.
///
/// `elsewhere_C`: points of the same scene that were seen from elsewhere (m, in C). They join the objects;
/// plane, sampling and image border are the cloud's.
[[nodiscard]] StageOneResult locate(const camera::OrganizedCloud& cloud, const StageOneParameters& parameters,
                                    const std::optional<Eigen::Vector3d>& near_C = std::nullopt,
                                    std::span<const Eigen::Vector3f> elsewhere_C = {});

/// The frame on a place of the chosen object's handles that is nearest to its visual centre of mass; none
/// without handles.
[[nodiscard]] std::optional<GraspFrame> nearest_grasp(const StageOneResult& result);

/// The grasp frame on the chosen object's `handle` at the axial position `along` (m from M), clamped to the
/// handle's ends, for Stage II's regrasp. Throws std::out_of_range for a handle that is not there.
[[nodiscard]] GraspFrame grasp_frame_at(const StageOneResult& result, int handle, double along);

}  // namespace walkman::perception
