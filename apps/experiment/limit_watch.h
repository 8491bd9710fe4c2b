#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "apps/shared/emulated_world.h"

namespace walkman::apps {

/// A hardware limit that the plant has exceeded.
struct PassedLimit {
  std::string what;             ///< "torque of RElbj, N·m": the same in every run
  double time = 0;              ///< s of the emulated clock
  double value = 0, limit = 0;  ///< in the unit that `what` names
};

/// "torque of RElbj, N·m: 250 at 31.405 s, expected at most 240".
[[nodiscard]] std::string to_string(const PassedLimit& passed);

/// Checks the plant's loads and motion against what the hardware survives. A limit is exceeded when
/// - an actuator exerts more than twice its joint's effort limit (a harmonic drive's momentary peak torque is
///   about twice its limit for repeated peaks, by its maker's catalogue), or a joint runs into its mechanical
///   stop faster than 0.1 rad/s,
/// - the load on a force/torque sensor leaves its range,
/// - the robot leans by half a radian, or an object falls at more than 0.5 m/s.
class LimitWatch {
 public:
  /// `sensors`: folder with the kinds of force/torque sensor. Keeps a reference to `world`, whose robot
  /// stands upright now. Throws std::runtime_error for a sensor's file that cannot be read.
  LimitWatch(EmulatedWorld& world, const std::filesystem::path& sensors);

  /// To be called after every step of the physics.
  void step();

  /// Each limit once, as it was first passed.
  [[nodiscard]] const std::vector<PassedLimit>& passed() const { return passed_; }

 private:
  struct WatchedJoint {
    int joint = -1;
    std::string name;
    double lower = 0, upper = 0, effort = 0;
    double speed = 0;  // rad/s, in the previous step
  };
  struct WatchedSensor {
    std::string name;
    Eigen::Matrix<double, 6, 1> range;  // torque, then force
  };

  void watch_joints();
  void watch_sensors();
  void watch_falls();
  void pass(const std::string& what, double value, double limit);

  EmulatedWorld& world_;
  std::vector<WatchedJoint> joints_;
  std::vector<WatchedSensor> sensors_;
  std::vector<double> heights_;  // of the objects, m
  Eigen::Vector3d up_B_;
  double now_ = 0, last_time_ = 0;
  std::vector<PassedLimit> passed_;
};

}  // namespace walkman::apps
