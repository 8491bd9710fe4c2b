#pragma once

#include <functional>
#include <string_view>
#include <utility>
#include <vector>

#include "emulator/plant/dynamics/multibody.h"
#include "emulator/scene/scene.h"

namespace walkman::plant {

/// Plays a scene's events: each begins with the first step at or after its time, or after the start of the
/// phase it waits for.
class EventPlayer {
 public:
  /// `reweigh` is called with an object's index and its weights from now on. Throws std::runtime_error naming
  /// file, line and key if a link to be pushed does not exist.
  EventPlayer(const Scene& scene, const RobotModel& robot, Multibody& body, double step,
              std::function<void(std::size_t, const std::vector<AttachedWeight>&)> reweigh);

  /// Call when whoever commands the robot begins this phase before step `step`.
  void begin_phase(std::string_view phase, long step);
  /// Returns the sensor faults that have begun since the last call.
  [[nodiscard]] std::vector<SensorFaultEvent> take_sensor_faults() {
    return std::exchange(sensor_faults_, {});
  }
  /// Plays the events of step `step`, counted from 0: applies forces for it, and changes before it.
  void play(long step);

 private:
  struct Planned {
    SceneEvent event;
    long first;            // step; not yet known while it waits for its phase
    int waits_for = 0;     // number of starts of that phase still to come
    int link = -1;         // link that is pushed
    std::size_t object{};  // object whose weight changes
    bool done = false;
  };
  void change_weights(const Planned& planned);

  Multibody& body_;
  double step_;  // s
  std::function<void(std::size_t, const std::vector<AttachedWeight>&)> reweigh_;
  std::vector<Planned> planned_;                      // in order of time, those that wait for phases last
  std::vector<std::vector<AttachedWeight>> weights_;  // present ones of each object
  std::vector<SensorFaultEvent> sensor_faults_;
};

}  // namespace walkman::plant
