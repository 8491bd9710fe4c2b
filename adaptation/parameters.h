#pragma once

#include <cstdint>
#include <filesystem>

namespace walkman {

/// How Stage I looks at an object: one cloud, and its centre of mass by the surface seen (paper); or the
/// clouds of several poses of the head together, and the centre of mass by the volume that they tell of.
enum class Look { kOnce, kAround };

/// Parameters of Stage I: from a range cloud to a grasp frame. Lengths in m, angles in rad. Defaults are the
/// paper's values where it gives them (sec. 3.1); adaptation/parameters.yaml says how the others were chosen.
struct StageOneParameters {
  Look look = Look::kOnce;
  double reach = 1.5;                ///< farther points from the camera are dropped (paper)
  double plane_distance = 0.01;      ///< inlier distance of the dominant plane, at least
  double plane_deviations = 2.5;     ///< the same in standard deviations of the cloud's noise
  double plane_normal_angle = 0.45;  ///< inlier angle between point and plane normal
  int plane_iterations = 300;
  double plane_min_share = 0.1;       ///< smallest share of the points in reach that makes a plane dominant
  double above_plane = 0.008;         ///< lowest height of an object point above the plane, at least
  double above_plane_deviations = 4;  ///< the same in standard deviations of the cloud's noise
  double highest_above_plane = 0.5;   ///< greatest height of an object point above the plane
  double cluster_tolerance = 0.02;    ///< longest step between neighbours of one cluster
  double cluster_min_area = 4e-4;     ///< m², smallest object, as the sensor sees it
  double asked_distance = 0.1;        ///< of an object from the point that it is asked for by, at most
  double outlier_voxel = 0.005;       ///< object points are thinned to this before outlier removal
  int outlier_neighbours = 20;
  double outlier_deviations = 2.0;
  double smoothing_radius = 0.025;  ///< moving least squares, second degree (paper)
  double smoothing_voxel = 0.006;   ///< spacing of the smoothed points
  double centroid_voxel = 0.01;     ///< voxels whose centroids' median is the CoM (paper)
  int handle_samples = 2000;
  double handle_neighbourhood = 0.025;  ///< radius, between 2 and 3 cm (paper)
  double handle_min_radius = 0.015;     ///< of the hand's size
  double handle_max_radius = 0.05;
  double handle_gap = 0.008;            ///< free space around a handle
  int handle_min_inliers = 15;          ///< fewest cylindrical shells that make a handle
  double handle_align_angle = 0.4;      ///< between the axes of a handle's shells
  double handle_align_distance = 0.02;  ///< between the axes of a handle's shells
  double handle_align_radius = 0.012;   ///< between the radii of a handle's shells
  std::uint64_t seed = 1;               ///< of the random samples
  int threads = 2;                      ///< the result does not depend on it
};

/// Parameters of Stage II and of the motions around it. Lengths in m, times in s. The paper's values where it
/// gives them (sec. 3.2 and 4.2).
struct StageTwoParameters {
  double torque_threshold = 0.02;        ///< N·m, τ_thres (paper)
  double displacement_threshold = 0.02;  ///< d_thres (paper)
  double average_time = 2.0;             ///< of the weighing (paper)
  int max_regrasps = 3;
  /// At an object that the image's border cuts, with the head turned in between; 1: the head stays.
  int max_looks = 3;

  double tare_time = 1.0;     ///< average before the first grasp that removes the sensor's residuals
  double pose_time = 0.5;     ///< average in each pose of an empty or loaded hand that turns
  double rest_speed = 0.006;  ///< m/s: a hand no faster is at rest
  double rest_time = 0.41;    ///< for so long, before a measurement
  double rest_timeout = 15;   ///< a hand that has not come to rest by then does not
  // Of the wrist's sensor: standard deviations of its matrix after calibration, and its data sheet's full
  // scale.
  double sensor_gain = 0.015;             ///< of an axis
  double sensor_axial_gain = 0.007;       ///< of the force along z
  double sensor_cross_talk = 0.01;        ///< of a force on another, of a torque on another
  double sensor_force_per_torque = 0.3;   ///< 1/m
  double sensor_torque_per_force = 5e-4;  ///< m
  double sensor_force_range = 1500;       ///< N
  double sensor_torque_range = 35;        ///< N·m, likewise
  double calibration_turn = 0.7;          ///< rad, of the empty hand to either side, to calibrate it
  double weighing_turn = 0.5;             ///< rad, of the hand that holds, about the handle to either side
  double approach_height = 0.15;          ///< above the grasp, straight up
  double approach_back = 0.08;            ///< and towards the robot
  double palm_clearance = 0.003;          ///< between palm and object surface before the hand closes
  double lift_height = 0.08;              ///< first lift
  double lift_step = 0.02;                ///< further lifts while the force still changes with height
  double lift_max = 0.16;
  double lift_force_change = 0.15;  ///< N over one step: below this nothing of the object rests any more
  double payload_time = 0.5;        ///< in which the feed-forward takes the object's weight over
  double lift_window = 0.5;         ///< average for that comparison
  double min_force = 1.0;           ///< N, less than this is no object in the hand
  double watch_time = 1.0;          ///< s that the last grasp is held for, and its load watched
  // What a sound wrist sensor's reading of a still hand changes by at most: while it is averaged, N/s and
  // N·m/s, and from before a grasp to after the release, N and N·m.
  double force_slope = 0.3, torque_slope = 0.01;
  double force_drift = 0.6, torque_drift = 0.04;

  double close_time = 1.2;
  double hold_time = 0.6;       ///< after closing or opening
  double grip_torque = 1.0;     ///< share of the hand motor's rated torque
  double touch_force = 20;      ///< N beside the weight of an empty hand: more is a touch
  double empty_closure = 0.97;  ///< share of the motor's travel beyond which the hand has closed on nothing

  double travel_speed = 0.30;    ///< m/s, free motion
  double approach_speed = 0.08;  ///< m/s, near the object
  double lift_speed = 0.06;      ///< m/s
  double hanging_turn = 0.5;     ///< rad, the farthest for the centre of mass to hang below the hand
  double hanging_roll = 0.35;    ///< rad, the same across the handle
  double carry_time = 3.0;       ///< s that a motion with the object in the hand takes at least
  double angular_speed = 0.8;    ///< rad/s
};

struct MethodParameters {
  StageOneParameters stage_one;
  StageTwoParameters stage_two;
};

/// Reads a YAML file with the sections `stage_one` and `stage_two`, whose keys are the members' names. What
/// is not there keeps its default. Throws std::runtime_error, one sentence with file, line, key, what was
/// found and what was expected, for a file that cannot be read, unknown or repeated keys, and values out of
/// range.
[[nodiscard]] MethodParameters load_method_parameters(const std::filesystem::path& file);

}  // namespace walkman
