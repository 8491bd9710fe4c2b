#pragma once

namespace walkman::motion {

struct TwistDamperOptions {
  /// The torso's joint is offset against the twist, by this time (s) multiplied by the twist's rate. This
  /// adds half of it times the sway's angular frequency (1.2 to 1.9 Hz, depending on where the arms are) to
  /// the damping ratio; the part that the friction of the joint's motor absorbs remains.
  double velocity_time = 0.08;
  double low_pass_hz = 10;   ///< corner of two first-order filters: arms with a long bar ring at 13 Hz
  double max_angle = 0.003;  ///< rad: arms that come to rest twist the torso by as much
  /// rad/s; a torso that turns faster is being pushed. The law fades in again after it: balance comes first.
  double push_rate = 0.15;
  double fade_in = 1;  ///< s, after `restart`
};

/// Damps the sway of a standing robot about the vertical: that of its arms and torso, on the springs of the
/// hips and the waist. The joint between legs and torso is moved against the twist's rate. The law has no
/// effect at rest. Neither allocates nor throws.
class TwistDamper {
 public:
  explicit TwistDamper(const TwistDamperOptions& options = {}) : options_(options) {}

  /// Call after cycles without a reading: clears the state.
  void restart() noexcept { running_ = false; }
  /// Runs one cycle of `dt` s. `twist`: rotation of the torso about the vertical relative to the reference,
  /// rad. Returns the offset of the joint's set-point, rad.
  double step(double twist, double dt) noexcept;

 private:
  TwistDamperOptions options_;
  bool running_ = false;
  double running_for_ = 0;                        // s
  double last_ = 0, first_stage_ = 0, rate_ = 0;  // rad, rad/s
};

}  // namespace walkman::motion
