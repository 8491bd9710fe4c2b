#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "drivers/canopen/fault_cause.h"
#include "drivers/time.h"

namespace walkman::cia402 {

/// Checks that the reports of a drive in operation match its motor, its spring and its commands.
///
/// - The motor's speed changes by no more than `kMostAcceleration` allows, or than a set-point may change it
///   in one step: otherwise its encoder has jumped.
/// - The spring is deflected no faster than the joint can turn: otherwise torque or link encoder have jumped.
/// - The link moves with the motor, if only a little: otherwise the link encoder is stuck.
/// - The motor is at its commanded position: otherwise it is locked or too weak, its encoder is stuck, or the
///   set-points do not reach it.
class MotionCheck {
 public:
  /// Peak torque over motor inertia of the drives is up to 490 rad/s², and a loaded spring can add as much.
  static constexpr double kMostAcceleration = 1000;  // rad/s²
  /// The motor-side loop holds to within a thousandth of a radian, and under a heavier load to within a few
  /// of them until its integral term responds; with the arm stretched, the window moves the hand by 7 mm, a
  /// quarter of the thinnest handle.
  static constexpr double kFollowingWindow = 0.01;  // rad
  static constexpr Time kFollowingTime = std::chrono::milliseconds(50);
  /// This far off there is no point in waiting: a runaway motor is as fast by then as a falling object.
  static constexpr double kFarOff = 5 * kFollowingWindow;  // rad
  /// A motor counts as pushed off its set-point if its spring carries this share of the joint's effort limit:
  /// near the limit of the weakest motor (41 of 60 N·m). After a push that the robot withstands, it is back
  /// within this time. A motor that does not move at all is not being pushed.
  static constexpr Time kPushedTime = std::chrono::milliseconds(200);
  static constexpr double kPushed = 0.6;

  /// How far a motor may move without its link: four times the window above. A link held by something solid
  /// still yields with it, by more than one step of the resolution with which the drive reports it: an arm on
  /// a table was seen to stay within two steps while its motor moved half as far.
  static constexpr double kAlone = 4 * kFollowingWindow;  // rad

  /// Constants during operation.
  struct Joint {
    double most_velocity = 0;    ///< rad/s
    double spring_constant = 0;  ///< N·m/rad, 0 if unknown
    double most_torque = 0;      ///< N·m
    double torque_step = 0;      ///< resolution of the reported torque, N·m
  };

  /// Takes values sampled `periods` SYNC periods of `period` after the last ones. `set_point`: the last one
  /// sent, motor position in rad.
  void take(double motor_position, double torque, double set_point, std::int64_t periods, Time period,
            const Joint& joint) noexcept;
  /// Restarts the checks: when out of operation, or after a fault was handled.
  void restart() noexcept { *this = {}; }

  [[nodiscard]] std::optional<canopen::FaultCause> cause() const noexcept;

 private:
  void follow(double motor_position, double velocity, double set_point, Time elapsed, bool loaded) noexcept;
  void watch_link(double motor_position, double torque, const Joint& joint) noexcept;

  enum class Found { kNothing, kPositionJump, kTorqueJump, kLinkStands, kNotFollowing };

  Found found_ = Found::kNothing;  // first one found
  double amount_ = 0;              // rad or N·m
  Time since_{};
  int samples_ = 0;  // up to 2
  double position_ = 0, velocity_ = 0, torque_ = 0;
  // The last two. A set-point is taken over with the SYNC after it, and reached with the next; a drive may be
  // one SYNC faster.
  std::array<double, 2> set_points_{};
  bool pushed_ = false;  // at the start of the deviation
  Time still_{};         // duration of exactly the same position
  Time astray_{};        // duration of the deviation
  // Positions of link and motor when the link last moved.
  double link_stands_ = 0, motor_then_ = 0;
};

}  // namespace walkman::cia402
