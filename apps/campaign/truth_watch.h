#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/campaign/golden_trace.h"
#include "apps/campaign/run_observation.h"
#include "apps/experiment/repetition_watch.h"

namespace walkman::apps {

/// Observes a run from the emulator's side: the motion of its plant and the traffic on its buses, as well as
/// what the drivers and the method show.
///
/// The plant counts as off when it leaves the path of the golden twin: when, regardless of whether it is
/// early or late, a joint is 0.01 rad, or the base or an object 10 mm, away from every position of the golden
/// twin around that time. The drivers let a drive deviate as much from its set-point, which results in that
/// distance at the end of an arm. A hardware limit is exceeded when
/// - an actuator exerts more than twice its joint's effort limit (a harmonic drive's momentary peak torque is
///   about twice its limit for repeated peaks, by its maker's catalogue), or a joint runs into its mechanical
///   stop faster than 0.1 rad/s,
/// - the load on a force/torque sensor leaves its range,
/// - the robot touches itself or its surroundings (`TouchWatch`), leans by half a radian, or an object falls.
/// All are checked once a cycle. The robot stands still from the time after which no joint leaves a band of
/// 0.02 rad: a body on springs swings for a long time after a stop without leaving its place.
class TruthWatch : public RepetitionWatch {
 public:
  /// `golden`: the twin to compare with, which must outlive this object; null if this is the golden run
  /// itself. `sensors`: folder with the kinds of force/torque sensor.
  TruthWatch(const GoldenTrace* golden, std::filesystem::path sensors)
      : golden_(golden), sensor_folder_(std::move(sensors)) {}

  void begins(EmulatedWorld& world, const robot::Robot& robot, const Judge& judge) override;
  void phase_begins(std::string_view phase) override { observation_.phases.emplace_back(phase); }
  void cycle() override;
  void warned(std::string_view sentence) override;
  void over(const RepetitionResult& result, robot::Cycle& cycle) override;

  [[nodiscard]] const RunObservation& observation() const { return observation_; }
  /// The trace of a golden run.
  [[nodiscard]] const GoldenTrace& trace() const { return trace_; }

 protected:
  [[nodiscard]] EmulatedWorld& world() { return *world_; }

 private:
  struct WatchedJoint {
    int joint = -1;
    std::string name;
    double lower = 0, upper = 0, effort = 0;
    double speed = 0;  // rad/s, in the previous cycle
  };
  struct WatchedSensor {
    std::string name;
    Eigen::Matrix<double, 6, 1> range;  // torque, then force
  };

  void watch_devices();
  void compare();
  [[nodiscard]] bool off_path();
  void find_standstill();
  void watch_limits();
  void watch_faults();
  void pass(const std::string& what, double value, double limit);
  void show(ShownEvent::By by, double time, std::string device, std::string text);
  [[nodiscard]] std::string device_in(std::string_view text) const;
  [[nodiscard]] double now() const;

  const GoldenTrace* golden_;
  std::filesystem::path sensor_folder_;
  EmulatedWorld* world_ = nullptr;
  const robot::Robot* robot_ = nullptr;
  const Judge* judge_ = nullptr;
  RunObservation observation_;
  GoldenTrace trace_;
  std::uint64_t frames_hash_ = 14695981039346656037ULL;  // FNV-1a
  std::size_t cycle_ = 0, place_on_path_ = 0;
  std::vector<float> positions_;
  std::vector<float> path_;  // of the joints, cycle by cycle
  std::vector<WatchedJoint> joints_;
  std::vector<WatchedSensor> sensors_;
  std::vector<double> heights_;  // of the objects, m
  Eigen::Vector3d up_B_ = Eigen::Vector3d::UnitZ();
  double last_time_ = 0;
  std::size_t touches_ = 0, recoveries_ = 0;
  Time last_fault_ = Time::min();
};

}  // namespace walkman::apps
