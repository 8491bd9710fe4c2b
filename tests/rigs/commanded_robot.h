#pragma once

#include <functional>
#include <vector>

#include "adaptation/regrasp/grasp_planner.h"
#include "adaptation/regrasp/manipulator.h"
#include "drivers/robot/cycle.h"
#include "drivers/robot/robot.h"
#include "emulator/emulator.h"

namespace walkman::rigs {

/// Advances an emulator by one SYNC period, in single physics steps.
class SteppedCycle : public robot::Cycle {
 public:
  SteppedCycle(Emulator& emulator, Time period) : emulator_(emulator), period_(period) {}

  Time next() override;

  /// Called instead of each step, which it has to perform by calling its argument; for clocks and counters.
  std::function<void(const std::function<void()>&)> each_step;

 private:
  Emulator& emulator_;
  Time period_;
};

/// The whole emulated robot on its embedded buses under the drivers' command: as in an experiment, but
/// without the camera. Ground truth is accessible for judging.
class CommandedRobot : private regrasp::Observer {
 public:
  /// `scene`: as loaded or changed; `emulator`: as in Emulator; `truth` turns the model that the drivers know
  /// into the true robot: masses and inertias, not names.
  CommandedRobot(Scene scene, const EmulatorOptions& emulator,
                 const std::function<void(RobotModel&)>& truth = {});

  /// Boots and takes the stance. Throws regrasp::RunStopped.
  void start();
  /// Grasps a handle of `radius` (m) by the frame X_TG on its surface; `over` is called with the hand over
  /// it.
  void grasp(const Eigen::Isometry3d& X_TG, double radius, const std::function<void()>& over = {});

  /// The drivers' safe stop or, without `stop`, their sudden end; then the world continues without them.
  void abandon(bool stop, Time period);

  /// Called after every cycle, outside of which nothing moves.
  std::function<void()> each_cycle;

  [[nodiscard]] const Scene& scene() const { return scene_; }
  [[nodiscard]] const RobotModel& model() const { return known_.model; }
  [[nodiscard]] const plant::Plant& plant() const { return emulator_.plant(); }
  [[nodiscard]] SteppedCycle& cycle() { return cycle_; }
  [[nodiscard]] regrasp::Session& session() { return session_; }
  [[nodiscard]] regrasp::Manipulator& manipulator() { return manipulator_; }
  [[nodiscard]] bool stands() const { return stands_; }
  /// Pose of the stance frame in the world, by the plant.
  [[nodiscard]] const Eigen::Isometry3d& X_WT() const { return X_WT_; }
  [[nodiscard]] double seconds() const;  ///< emulated
  /// Index of a force/torque frame among the plant's sensors.
  [[nodiscard]] int sensor(const std::string& frame) const;

  /// Grasp frame on top of the middle of a level object, `height` (m) above its axis, with the hand square to
  /// it.
  [[nodiscard]] Eigen::Isometry3d X_TG_on_top(int object, double height) const;

  /// Centre of mass of the robot in W, by the plant's link poses and true masses, m.
  [[nodiscard]] Eigen::Vector3d p_Wcm() const;

 private:
  void on_stance(bool stands, const Eigen::Isometry3d& X_TB) override;
  void on_cycle(Time now, const Wrench& F_So_S, const Eigen::Isometry3d& X_TH) override;

  Scene scene_;
  KnownRobot known_;
  RobotModel true_model_;
  Emulator emulator_;
  robot::Robot robot_;
  SteppedCycle cycle_;
  regrasp::Session session_;
  regrasp::Manipulator manipulator_;
  bool stands_ = false;
  Eigen::Isometry3d X_WT_ = Eigen::Isometry3d::Identity();
};

}  // namespace walkman::rigs
