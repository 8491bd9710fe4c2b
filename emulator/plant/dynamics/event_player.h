#pragma once

#include <functional>
#include <vector>

#include "emulator/plant/dynamics/multibody.h"
#include "emulator/scene/scene.h"

namespace walkman::plant {

/// Plays a scene's events: each begins with the first step at or after its time.
class EventPlayer {
 public:
  /// `reweigh` is called with an object's index and its weights as they are from now on. Throws
  /// std::runtime_error naming file, line and key when a link that is pushed is not there.
  EventPlayer(const Scene& scene, const RobotModel& robot, Multibody& body, double step,
              std::function<void(std::size_t, const std::vector<AttachedWeight>&)> reweigh);

  /// What happens in step `step`, counted from 0: forces for it, changes before it.
  void play(long step);

 private:
  struct Push {
    long first, end;  // steps
    int link;
    Eigen::Vector3d force_W, p_LP;
  };
  struct Change {
    long step;
    std::size_t object;
    std::vector<AttachedWeight> weights;
  };
  void add_change(const Scene& scene, long step, const SceneEvent& event);

  Multibody& body_;
  std::function<void(std::size_t, const std::vector<AttachedWeight>&)> reweigh_;
  std::vector<Push> pushes_;
  std::vector<Change> changes_;  // in order of time
  std::size_t next_change_ = 0;
  std::vector<std::vector<AttachedWeight>> weights_;  // of each object, after the changes so far read
};

}  // namespace walkman::plant
