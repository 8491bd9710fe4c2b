#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "emulator/plant/dynamics/multibody.h"

class btDispatcher;

namespace walkman::plant {

/// How far an object has slipped in a hand, summed over all the times the hand has held it.
struct Slip {
  bool held = false;  ///< the hand touches the object and no fixed body does
  double travel = 0;  ///< path of the object's grasped point in the hand's frame, m
  double turn = 0;    ///< angle the object has turned through in the hand's frame, in any direction, rad
};

/// Measures the slip of one object in one hand: ground truth, from poses and contacts.
///
/// The grasped point is the point of the object at the centre of the contacts when a hold begins. Path and
/// angle are counted in steps of `kTravelStep` and `kTurnStep`, so that the solver's jitter does not add up.
class SlipMeter {
 public:
  static constexpr double kTravelStep = 1e-4;  ///< m
  static constexpr double kTurnStep = 1e-3;    ///< rad

  /// The hand is `palm_link`'s rigid group and all groups it carries. `object` is measured at its root link.
  SlipMeter(const Multibody& robot, int palm_link, const Multibody& object);

  /// Call when the object has been rebuilt as this body, at the same pose.
  void follow(const Multibody& object) { object_ = &object; }
  /// Call after a step of the world whose contacts `dispatcher` holds.
  void update(btDispatcher& dispatcher);
  [[nodiscard]] const Slip& slip() const { return slip_; }

 private:
  const Multibody* robot_;
  const Multibody* object_;
  int palm_link_;
  std::vector<bool> hand_groups_;
  Eigen::Vector3d p_OG_ = Eigen::Vector3d::Zero();  // grasped point, in the object
  Eigen::Vector3d p_HG_ = Eigen::Vector3d::Zero();  // where it was last counted, in the hand
  Eigen::Quaterniond q_HO_ = Eigen::Quaterniond::Identity();
  Slip slip_;
};

}  // namespace walkman::plant
