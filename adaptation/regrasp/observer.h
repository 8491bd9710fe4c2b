#pragma once

#include <array>
#include <stdexcept>
#include <string>
#include <string_view>

#include "adaptation/perception/stage_one.h"
#include "drivers/camera/range_camera.h"
#include "drivers/time.h"
#include "urdf/reader/robot_description.h"
#include "urdf/reader/wrench.h"

namespace walkman::regrasp {

/// What the method is doing, in the order in which it first does it.
enum class Phase {
  kBoot,
  kSettle,
  kCalibrate,
  kLook,
  kApproach,
  kTare,
  kGrasp,
  kLift,
  kTurn,
  kWeigh,
  kWatch,
  kLower,
  kRetreat
};

/// The phases' names, in the order of `Phase`.
inline constexpr std::array<std::string_view, 13> kPhaseNames = {
    "boot", "settle", "calibrate", "look",  "approach", "tare",   "grasp",
    "lift", "turn",   "weigh",     "watch", "lower",    "retreat"};

[[nodiscard]] constexpr std::string_view to_string(Phase phase) {
  return kPhaseNames[static_cast<std::size_t>(phase)];
}

/// The run cannot go on; what() is one sentence for people. Whatever else ends a run is a defect.
class RunStopped : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The object asks for more than the hand or the arm can do, and the robot is as much in control as before.
class Refused : public RunStopped {
 public:
  using RunStopped::RunStopped;
};

/// The same of an object that a grasp nearer to its centre of mass may lift: what the wrist carried of it,
/// about the hand's Ho in T.
class HeldTooFar : public Refused {
 public:
  HeldTooFar(const std::string& reason, const Wrench& load_Ho_T) : Refused(reason), F_Ho_T(load_Ho_T) {}
  Wrench F_Ho_T;
};

/// What one lift measured. T is the robot's stance (motion::Stance; its base where that is held), H the
/// grasping hand's frame H_f.
struct Weighing {
  Wrench F_Ho_T;  ///< load of the object alone: sensor residual and hand weight removed
  Eigen::Isometry3d X_TH = Eigen::Isometry3d::Identity();
  double f_g = 0;               ///< force along gravity, N, positive downwards
  double torque = 0;            ///< |τ| about the grasp frame, N·m, signed like the displacement
  double force_deviation = 0;   ///< standard deviation of f_g, N
  double torque_deviation = 0;  ///< of the torque in the direction known worst, N·m
  double torque_about_handle =
      0;                    ///< of it the part about the handle's axis, which no place along it changes
  double displacement = 0;  ///< d: from the grasp to the CoM line, m along the handle, positive to the right
  double displacement_deviation = 0;  ///< of d, by the weighing; where the hand is has its own, m
  Eigen::Vector3d p_HCm = Eigen::Vector3d::Zero();  ///< the object's centre of mass, m
  bool changed = false;  ///< the load has become another since the weighing before, in the hand
};

/// The hand cannot go on from where it is to where it was to go.
class WayBlocked : public Refused {
 public:
  using Refused::Refused;
};

/// Reads what the pipeline knows as it learns it; has no way to change it.
class Observer {
 public:
  virtual ~Observer() = default;
  virtual void on_phase(std::string_view /*phase*/, Time /*now*/) {}
  /// A fault took something away while nothing was held, and the drivers have it back. `reason` is the
  /// fault's sentence.
  virtual void on_recovery(std::string_view /*reason*/, Time /*now*/) {}
  /// Something is not well and no fault, one sentence; each is told once, as it is learnt.
  virtual void on_warning(std::string_view /*warning*/, Time /*now*/) {}
  /// Once, after boot: the robot has found that it stands on its feet, or that it does not, and where its
  /// base is in T.
  virtual void on_stance(bool /*stands*/, const Eigen::Isometry3d& /*X_TB*/) {}
  /// The hand that works from now on.
  virtual void on_hand(const HandParts& /*hand*/) {}
  /// Once a cycle: the wrist sensor's raw reading and the hand's measured pose.
  virtual void on_cycle(Time /*now*/, const Wrench& /*F_So_S*/, const Eigen::Isometry3d& /*X_TH*/) {}
  virtual void on_located(const camera::OrganizedCloud& /*cloud*/,
                          const perception::StageOneResult& /*result*/) {}
  /// The frame about to be grasped.
  virtual void on_grasp(const Eigen::Isometry3d& /*X_TG*/) {}
  virtual void on_weighed(const Weighing& /*weighing*/) {}
};

}  // namespace walkman::regrasp
