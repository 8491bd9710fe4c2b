#include "adaptation/motion/hand_motion_options.h"

namespace walkman::motion {

HandMotionOptions hand_motion_options(const KnownRobot& known, const HandParts& hand) {
  HandMotionOptions options;
  const std::filesystem::path& srdf = known.description.srdf;
  options.hand_link = hand.frame;
  if (known.description.stance) options.twist_joint = known.description.stance->twist;
  options.disabled_collisions = load_disabled_collisions(srdf, known.model);
  const auto take = [&](const LimbParts& limb, std::map<std::string, double>& posture) {
    options.active_joints.insert(options.active_joints.end(), limb.joints.begin(), limb.joints.end());
    options.ranges.insert(options.ranges.end(), limb.ranges.begin(), limb.ranges.end());
    posture = load_posture(srdf, limb.posture, known.model);
  };
  if (known.description.torso) take(*known.description.torso, options.upright);
  take(hand.arm, options.posture);
  return options;
}

}  // namespace walkman::motion
