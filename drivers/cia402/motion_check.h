#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "drivers/canopen/fault_cause.h"
#include "drivers/time.h"

namespace walkman::cia402 {

/// Whether what a drive in operation reports is what its motor and its spring can do, and what it was told.
///
/// - The motor's speed changes by no more than `kMostAcceleration` lets it, or a set-point may in one step:
///   else its encoder has jumped.
/// - The spring is deflected no faster than the joint can turn: else torque or link encoder have jumped.
/// - Where the motor goes the link goes, if only a little: else its encoder stands still.
/// - The motor is where it was told to be: else it is locked or too weak, its encoder stands still, or the
///   set-points do not reach it.
class MotionCheck {
 public:
  /// Peak torque over motor inertia of the drives is up to 490 rad/s², and a loaded spring can add as much.
  static constexpr double kMostAcceleration = 1000;  // rad/s²
  /// The motor-side loop holds a thousandth of a radian, with a heavier load for the time that its integral
  /// takes some of them; with the arm stretched this moves the hand by 7 mm, a quarter of the thinnest
  /// handle.
  static constexpr double kFollowingWindow = 0.01;  // rad
  static constexpr Time kFollowingTime = std::chrono::milliseconds(50);
  /// So far off there is nothing to wait for: a motor that runs away is as fast as an object falls by then.
  static constexpr double kFarOff = 5 * kFollowingWindow;  // rad
  /// Of a motor that was pushed off: its spring carried this share of the joint's effort limit by then, more
  /// than the weakest motor can (41 of 60 N·m). A push that the robot stands through gives it back before
  /// this time.
  /// One that does not move at all is pushed by nobody.
  static constexpr Time kPushedTime = std::chrono::milliseconds(200);
  static constexpr double kPushed = 0.6;

  /// How far a motor goes without its link: four times the window above. A link that something solid holds
  /// gives way with it, by more than one step of what the drive reports of it: an arm on a table was seen to
  /// hold still within two while its motor went half as far.
  static constexpr double kAlone = 4 * kFollowingWindow;  // rad

  /// What does not change in operation.
  struct Joint {
    double most_velocity = 0;    ///< rad/s
    double spring_constant = 0;  ///< N·m/rad, 0 where it is not known
    double most_torque = 0;      ///< N·m
    double torque_step = 0;      ///< of what is reported, N·m
  };

  /// Values sampled `periods` SYNC periods of `period` after the last ones. `set_point`: the last sent, motor
  /// position in rad.
  void take(double motor_position, double torque, double set_point, std::int64_t periods, Time period,
            const Joint& joint) noexcept;
  /// Begins anew: out of operation, or after a fault was dealt with.
  void restart() noexcept { *this = {}; }

  [[nodiscard]] std::optional<canopen::FaultCause> cause() const noexcept;

 private:
  void follow(double motor_position, double set_point, Time elapsed, bool loaded) noexcept;
  void watch_link(double motor_position, double torque, const Joint& joint) noexcept;

  enum class Found { kNothing, kPositionJump, kTorqueJump, kLinkStands, kNotFollowing };

  Found found_ = Found::kNothing;  // the first
  double amount_ = 0;              // rad or N·m
  Time since_{};
  int samples_ = 0;  // up to 2
  double position_ = 0, velocity_ = 0, torque_ = 0;
  // The last two. One is taken with the SYNC after it, and reached with the next; a drive may be a SYNC
  // faster.
  std::array<double, 2> set_points_{};
  bool pushed_ = false;  // when that began
  Time still_{};         // the very same position for so long
  Time astray_{};        // for so long
  // Where link and motor were when the link last moved.
  double link_stands_ = 0, motor_then_ = 0;
};

}  // namespace walkman::cia402
