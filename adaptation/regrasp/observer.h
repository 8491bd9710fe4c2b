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

/// Phases of the method, in the order of their first occurrence.
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

/// Names of the phases, in the order of `Phase`.
inline constexpr std::array<std::string_view, 13> kPhaseNames = {
    "boot", "settle", "calibrate", "look",  "approach", "tare",   "grasp",
    "lift", "turn",   "weigh",     "watch", "lower",    "retreat"};

[[nodiscard]] constexpr std::string_view to_string(Phase phase) {
  return kPhaseNames[static_cast<std::size_t>(phase)];
}

/// The run cannot continue; what() is one human-readable sentence. Anything else that ends a run is a defect.
class RunStopped : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The object requires more than the hand or the arm can do; the robot is as much under control as before.
class Refused : public RunStopped {
 public:
  using RunStopped::RunStopped;
};

/// As `Refused`, for an object that a grasp nearer to its centre of mass may lift. `F_Ho_T`: the object's
/// load on the wrist, about the hand's Ho in T.
class HeldTooFar : public Refused {
 public:
  HeldTooFar(const std::string& reason, const Wrench& load_Ho_T) : Refused(reason), F_Ho_T(load_Ho_T) {}
  Wrench F_Ho_T;
};

/// Measurements of one lift. T is the robot's stance frame (motion::Stance; its base frame if the base is
/// held), H the grasping hand's frame H_f.
struct Weighing {
  Wrench F_Ho_T;  ///< load of the object alone: sensor residual and hand weight removed
  Eigen::Isometry3d X_TH = Eigen::Isometry3d::Identity();
  double f_g = 0;                  ///< force along gravity, N, positive downwards
  double torque = 0;               ///< |τ| about the grasp frame, N·m, signed like the displacement
  double force_deviation = 0;      ///< standard deviation of f_g, N
  double torque_deviation = 0;     ///< of the torque in its worst-known direction, N·m
  double torque_about_handle = 0;  ///< torque about the handle's axis, which no place along it changes
  double displacement = 0;  ///< d: from the grasp to the CoM line, m along the handle, positive to the right
  double displacement_deviation = 0;  ///< of d, by the weighing, without the error of the hand's position, m
  Eigen::Vector3d p_HCm = Eigen::Vector3d::Zero();  ///< the object's centre of mass, m
  bool changed = false;                             ///< the load differs from that of the previous weighing
  bool in_hand = false;  ///< weighed without a grasp of its own, because the load changed in the hand
};

/// The hand cannot continue from its present pose to its target.
class WayBlocked : public Refused {
 public:
  using Refused::Refused;
};

/// Receives what the pipeline learns, as it learns it; cannot change it.
class Observer {
 public:
  virtual ~Observer() = default;
  virtual void on_phase(std::string_view /*phase*/, Time /*now*/) {}
  /// The drivers have recovered from a fault that occurred while nothing was held. `reason`: the fault's
  /// sentence.
  virtual void on_recovery(std::string_view /*reason*/, Time /*now*/) {}
  /// A problem that is not a fault, in one sentence; each is reported once, when it is detected.
  virtual void on_warning(std::string_view /*warning*/, Time /*now*/) {}
  /// Called once, after boot: whether the robot stands on its feet, and where its base is in T.
  virtual void on_stance(bool /*stands*/, const Eigen::Isometry3d& /*X_TB*/) {}
  /// The active hand from now on.
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
