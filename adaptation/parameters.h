#pragma once

#include <cstdint>
#include <filesystem>

namespace walkman {

/// How Stage I observes an object: from one cloud, with its centre of mass from the visible surface (paper);
/// or from the combined clouds of several head poses, with its centre of mass from the volume they imply.
enum class Look { kOnce, kAround };

/// Parameters of Stage I: from a range cloud to a grasp frame. Lengths in m, angles in rad. Defaults are the
/// paper's values where it gives them (sec. 3.1); adaptation/parameters.yaml says how the others were chosen.
struct StageOneParameters {
  Look look = Look::kOnce;
  double reach = 1.5;                ///< points farther than this from the camera are dropped (paper)
  double plane_distance = 0.01;      ///< inlier distance of the dominant plane, lower bound
  double plane_deviations = 2.5;     ///< the same in standard deviations of the cloud's noise
  double plane_normal_angle = 0.45;  ///< inlier angle between the normals of point and plane
  int plane_iterations = 300;
  double plane_min_share = 0.1;  ///< smallest share of the points within reach that makes a plane dominant
  double above_plane = 0.008;    ///< minimum height of an object point above the plane, lower bound
  double above_plane_deviations = 4;  ///< the same in standard deviations of the cloud's noise
  double highest_above_plane = 0.5;   ///< maximum height of an object point above the plane
  double cluster_tolerance = 0.02;    ///< longest step between neighbours in a cluster
  double cluster_min_area = 4e-4;     ///< m², area of the smallest object, as seen by the sensor
  double asked_distance = 0.1;        ///< maximum distance of an object from the requested point
  double outlier_voxel = 0.005;       ///< object points are thinned to this before outlier removal
  int outlier_neighbours = 20;
  double outlier_deviations = 2.0;
  double smoothing_radius = 0.025;  ///< moving least squares, second degree (paper)
  double smoothing_voxel = 0.006;   ///< spacing of the smoothed points
  double centroid_voxel = 0.01;     ///< voxel size; the CoM is the median of the voxels' centroids (paper)
  int handle_samples = 2000;
  double handle_neighbourhood = 0.025;  ///< radius, between 2 and 3 cm (paper)
  double handle_min_radius = 0.015;     ///< given by the size of the hand
  double handle_max_radius = 0.05;
  double handle_gap = 0.008;            ///< free space around a handle
  int handle_min_inliers = 15;          ///< minimum number of cylindrical shells in a handle
  double handle_align_angle = 0.4;      ///< maximum, between the axes of a handle's shells
  double handle_align_distance = 0.02;  ///< maximum, between the axes of a handle's shells
  double handle_align_radius = 0.012;   ///< maximum, between the radii of a handle's shells
  std::uint64_t seed = 1;               ///< of the random sampling
  int threads = 2;                      ///< the result does not depend on it
};

/// Parameters of Stage II and of the motions around it. Lengths in m, times in s. Defaults are the paper's
/// values where it gives them (sec. 3.2 and 4.2).
struct StageTwoParameters {
  double torque_threshold = 0.02;        ///< N·m, τ_thres (paper)
  double displacement_threshold = 0.02;  ///< d_thres (paper)
  double average_time = 2.0;             ///< averaging time of the weighing (paper)
  int max_regrasps = 3;
  /// Views of an object that the image border cuts off, with the head turned in between; 1: the head stays.
  int max_looks = 3;

  double tare_time = 1.0;     ///< average before each grasp, which removes the sensor's residuals
  double pose_time = 0.5;     ///< averaging time in each pose in which the empty or loaded hand is turned
  double rest_speed = 0.006;  ///< m/s: a hand no faster than this is at rest
  double rest_time = 0.41;    ///< for this long, before a measurement
  double rest_timeout = 15;   ///< a hand not at rest by then counts as never coming to rest
  // Wrist sensor: standard deviations of its matrix after calibration, and full scale from its data sheet.
  double sensor_gain = 0.015;             ///< gain of an axis
  double sensor_axial_gain = 0.007;       ///< gain of the force along z
  double sensor_cross_talk = 0.01;        ///< from one force to another, or one torque to another
  double sensor_force_per_torque = 0.3;   ///< 1/m
  double sensor_torque_per_force = 5e-4;  ///< m
  double sensor_force_range = 1500;       ///< N, full scale
  double sensor_torque_range = 35;        ///< N·m, full scale
  double calibration_turn = 0.7;          ///< rad, turn of the empty hand to either side, for calibration
  double weighing_turn = 0.5;             ///< rad, turn of the holding hand about the handle to either side
  double approach_height = 0.15;          ///< straight up from the grasp
  double approach_back = 0.08;            ///< and back towards the robot
  double palm_clearance = 0.003;          ///< between palm and object surface before the hand closes
  double lift_height = 0.08;              ///< first lift
  double lift_step = 0.02;                ///< further lifts while the force still changes with height
  double lift_max = 0.16;
  double lift_force_change = 0.15;  ///< N over one step: below this nothing supports the object any more
  double payload_time = 0.5;        ///< in which the feed-forward takes over the object's weight
  double lift_window = 0.5;         ///< averaging time for comparing the force between lifts
  double min_force = 1.0;           ///< N, below this there is no object in the hand
  double watch_time = 1.0;          ///< s for which the last grasp is held and its load monitored
  // Maximum change of a sound wrist sensor's reading of a still hand: while it is averaged, N/s and N·m/s,
  // and from before a grasp to after the release, N and N·m.
  double force_slope = 0.3, torque_slope = 0.01;
  double force_drift = 0.6, torque_drift = 0.04;

  double close_time = 1.2;
  double hold_time = 0.6;       ///< wait after closing or opening
  double grip_torque = 1.0;     ///< fraction of the hand motor's rated torque
  double touch_force = 20;      ///< N beyond the weight of an empty hand: above this it counts as contact
  double empty_closure = 0.97;  ///< fraction of the motor's travel: beyond it the hand has closed on nothing

  double travel_speed = 0.30;    ///< m/s, free motion
  double approach_speed = 0.08;  ///< m/s, near the object
  double lift_speed = 0.06;      ///< m/s
  double hanging_turn = 0.5;     ///< rad, largest turn to let the centre of mass hang below the hand
  double hanging_roll = 0.35;    ///< rad, the same across the handle
  double carry_time = 3.0;       ///< s, minimum duration of a motion with the object in the hand
  double angular_speed = 0.8;    ///< rad/s
};

struct MethodParameters {
  StageOneParameters stage_one;
  StageTwoParameters stage_two;
};

/// Reads a YAML file with the sections `stage_one` and `stage_two`, whose keys are the members' names.
/// Missing keys keep their defaults. Throws std::runtime_error, with one sentence giving file, line, key,
/// what was found and what was expected, for a file that cannot be read, unknown or repeated keys, and values
/// out of range.
[[nodiscard]] MethodParameters load_method_parameters(const std::filesystem::path& file);

}  // namespace walkman
