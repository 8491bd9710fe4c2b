#pragma once

namespace walkman::motion {

struct TwistDamperOptions {
  /// The torso's joint gives way to the twist by this time multiplied with its rate, s. It adds half of it
  /// times the sway's angular frequency, 1.2 to 1.9 Hz by where the arms are, to the damping ratio; what the
  /// friction of the joint's motor swallows stays.
  double velocity_time = 0.08;
  double low_pass_hz = 10;   ///< corner of two first-order filters: arms with a long bar ring at 13 Hz
  double max_angle = 0.003;  ///< rad: arms that come to rest twist the torso by as much
  /// rad/s; what turns the torso faster is a push. The law fades in anew after it: the balance comes first.
  double push_rate = 0.15;
  double fade_in = 1;  ///< s, after `restart`
};

/// Damps how a robot that stands sways about the vertical: its arms and torso, on the springs of the hips and
/// the waist. The joint between legs and torso gives way to the twist's rate. The law has no say at rest.
/// Allocates nothing, throws nothing.
class TwistDamper {
 public:
  explicit TwistDamper(const TwistDamperOptions& options = {}) : options_(options) {}

  /// Forgets the past: after cycles without a reading.
  void restart() noexcept { running_ = false; }
  /// One cycle of `dt` s. `twist` is how far the torso is turned about the vertical from where the reference
  /// has it, rad. Returns what the joint's set-point is to be off by, rad.
  double step(double twist, double dt) noexcept;

 private:
  TwistDamperOptions options_;
  bool running_ = false;
  double running_for_ = 0;                        // s
  double last_ = 0, first_stage_ = 0, rate_ = 0;  // rad, rad/s
};

}  // namespace walkman::motion
