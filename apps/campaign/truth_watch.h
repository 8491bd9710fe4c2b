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
/// distance at the end of an arm. The limits are those of `LimitWatch`, and that the robot touches neither
/// itself nor its surroundings (`TouchWatch`). The robot stands still from the time after which no joint
/// leaves a band of 0.02 rad: a body on springs swings for a long time after a stop without leaving its
/// place.
class TruthWatch : public RepetitionWatch {
 public:
  /// `golden`: the twin to compare with, which must outlive this object; null if this is the golden run
  /// itself.
  explicit TruthWatch(const GoldenTrace* golden) : golden_(golden) {}

  void begins(EmulatedWorld& world, const robot::Robot& robot, const Judge& judge,
              const LimitWatch& limits) override;
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
  void compare();
  [[nodiscard]] bool off_path();
  void find_standstill();
  void watch_touches();
  void watch_faults();
  void show(ShownEvent::By by, double time, std::string device, std::string text);
  [[nodiscard]] std::string device_in(std::string_view text) const;
  [[nodiscard]] double now() const;

  const GoldenTrace* golden_;
  EmulatedWorld* world_ = nullptr;
  const robot::Robot* robot_ = nullptr;
  const Judge* judge_ = nullptr;
  const LimitWatch* limits_ = nullptr;
  RunObservation observation_;
  GoldenTrace trace_;
  std::uint64_t frames_hash_ = 14695981039346656037ULL;  // FNV-1a
  std::size_t cycle_ = 0, place_on_path_ = 0;
  std::vector<float> positions_;
  std::vector<float> path_;                          // of the joints, cycle by cycle
  std::vector<std::pair<int, std::string>> joints_;  // the driven ones: index and name
  std::size_t touches_ = 0, recoveries_ = 0;
  Time last_fault_ = Time::min();
};

}  // namespace walkman::apps
