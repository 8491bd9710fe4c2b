#pragma once

#include <functional>
#include <string_view>
#include <utility>
#include <vector>

#include "emulator/plant/dynamics/multibody.h"
#include "emulator/scene/scene.h"

namespace walkman::plant {

/// Plays a scene's events: each begins with the first step at or after its time, or after the beginning of
/// the phase that it waits for.
class EventPlayer {
 public:
  /// `reweigh` is called with an object's index and its weights as they are from now on. Throws
  /// std::runtime_error naming file, line and key when a link that is pushed is not there.
  EventPlayer(const Scene& scene, const RobotModel& robot, Multibody& body, double step,
              std::function<void(std::size_t, const std::vector<AttachedWeight>&)> reweigh);

  /// Whoever commands the robot begins this phase before step `step`.
  void begin_phase(std::string_view phase, long step);
  /// Those on sensors that have begun since the last question.
  [[nodiscard]] std::vector<SensorFaultEvent> take_sensor_faults() {
    return std::exchange(sensor_faults_, {});
  }
  /// What happens in step `step`, counted from 0: forces for it, changes before it.
  void play(long step);

 private:
  struct Planned {
    SceneEvent event;
    long first;            // step; none yet while it waits for its phase
    int waits_for = 0;     // beginnings of that
    int link = -1;         // that is pushed
    std::size_t object{};  // whose weight it is
    bool done = false;
  };
  void change_weights(const Planned& planned);

  Multibody& body_;
  double step_;  // s
  std::function<void(std::size_t, const std::vector<AttachedWeight>&)> reweigh_;
  std::vector<Planned> planned_;                      // in order of time, those of phases last
  std::vector<std::vector<AttachedWeight>> weights_;  // of each object, as they are now
  std::vector<SensorFaultEvent> sensor_faults_;
};

}  // namespace walkman::plant
