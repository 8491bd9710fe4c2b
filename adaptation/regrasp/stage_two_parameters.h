#pragma once

#include <filesystem>

#include "adaptation/perception/stage_one.h"

namespace walkman::regrasp {

/// Parameters of Stage II and of the motions around it. Lengths in m, times in s. The paper's values where it
/// gives them (sec. 3.2 and 4.2).
struct StageTwoParameters {
  double torque_threshold = 0.02;        ///< N·m, τ_thres (paper)
  double displacement_threshold = 0.02;  ///< d_thres (paper)
  double average_time = 2.0;             ///< of the weighing (paper)
  int max_regrasps = 3;

  double tare_time = 1.0;            ///< average before the first grasp that removes the sensor's residuals
  double settle_time = 1.5;          ///< after a motion, before a measurement
  double sensor_cross_talk = 0.01;   ///< of the wrist's sensor, of full scale (its data sheet)
  double sensor_force_range = 1500;  ///< N, its full scale
  double sensor_torque_range = 35;   ///< N·m, likewise
  double calibration_turn = 0.7;     ///< rad, of the empty hand to either side, to calibrate it
  double weighing_turn = 0.25;       ///< rad, of the hand that holds, about the handle to either side
  double approach_height = 0.15;     ///< above the grasp, straight up
  double approach_back = 0.08;       ///< and towards the robot
  double palm_clearance = 0.003;     ///< between palm and object surface before the hand closes
  double lift_height = 0.08;         ///< first lift
  double lift_step = 0.02;           ///< further lifts while the force still changes with height
  double lift_max = 0.16;
  double lift_force_change = 0.15;  ///< N over one step: below this nothing of the object rests any more
  double payload_time = 0.5;        ///< in which the feed-forward takes the object's weight over
  double lift_window = 0.5;         ///< average for that comparison
  double min_force = 1.0;           ///< N, less than this is no object in the hand

  double close_time = 1.2;
  double hold_time = 0.6;       ///< after closing or opening
  double grip_torque = 0.5;     ///< share of the hand motor's rated torque
  double empty_closure = 0.97;  ///< share of the motor's travel beyond which the hand has closed on nothing

  double travel_speed = 0.30;    ///< m/s, free motion
  double approach_speed = 0.08;  ///< m/s, near the object
  double lift_speed = 0.06;      ///< m/s
  double angular_speed = 0.8;    ///< rad/s
};

struct Parameters {
  perception::StageOneParameters stage_one;
  StageTwoParameters stage_two;
};

/// Reads both stages' parameters from one YAML file with the sections `stage_one` and `stage_two`. Missing
/// keys keep their defaults; unknown ones are errors with file, line and key.
[[nodiscard]] Parameters load_parameters(const std::filesystem::path& yaml_file);

}  // namespace walkman::regrasp
