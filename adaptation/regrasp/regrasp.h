#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "adaptation/parameters.h"
#include "adaptation/regrasp/ending.h"
#include "adaptation/regrasp/observer.h"
#include "drivers/robot/cycle.h"
#include "drivers/robot/robot.h"
#include "urdf/reader/robot_description.h"

namespace walkman::regrasp {

/// What the robot does while a cloud is evaluated, which takes longer than a cycle.
enum class Thinking {
  kBetweenCycles,  ///< nothing: the clock stands still meanwhile, as under emulation in lock-step
  kWhileHolding,   ///< holds its posture, cycle by cycle; the evaluation runs in its own thread
};

struct Report {
  std::vector<Weighing> weighings;  ///< one per lift, plus one whenever the load changed in the hand
  Ending ending = Ending::kMinimumTorque;
  /// What keeps the hands from a place that would be nearer by more than d_thres, in one sentence; empty if
  /// nothing does.
  std::string hindrance;
};

/// The paper's method: Stage I finds handles and grasps the one nearest to the visual centre of mass; Stage
/// II lifts, weighs with the wrist's force/torque sensor, and regrasps where the wrist torque is least. Ends
/// with the object held in the air.
///
/// Knows the robot only through its drivers, the camera and the URDF.
class Regrasp {
 public:
  Regrasp(const KnownRobot& known, robot::Robot& robot, robot::Cycle& cycle, camera::RangeCamera& camera,
          const MethodParameters& parameters, Observer& observer,
          Thinking thinking = Thinking::kBetweenCycles);
  ~Regrasp();

  /// Runs from power-on to the last weighing. Throws RunStopped with one sentence if it has to stop.
  [[nodiscard]] Report run();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace walkman::regrasp
