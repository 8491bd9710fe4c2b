#include "emulator/plant/hands/soft_hand.h"

#include <algorithm>
#include <stdexcept>

namespace walkman::plant {
namespace {

constexpr double kOffTheStop = 0.05;  // rad, over which a soft stop is unloaded

}  // namespace

SoftHand::SoftHand(const RobotModel& model, Multibody& body, const std::string& synergy_joint,
                   const ActuatorParameters& actuator, const SoftHandParameters& parameters)
    : body_(body), parameters_(parameters), actuator_(actuator, Transmission::kTendon) {
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const Joint& joint = model.joints[i];
    if (!joint.mimic || joint.mimic->joint != synergy_joint) continue;
    const auto parent = static_cast<std::size_t>(joint.parent_link);
    const int carrier = model.links[parent].parent_joint;
    const bool distal = carrier >= 0 && model.joints[static_cast<std::size_t>(carrier)].mimic.has_value();
    const bool thumb = joint.name.find("Thumb") != std::string::npos;
    const double lever = distal ? parameters_.distal_radius : parameters_.proximal_radius;
    joints_.push_back({body.bullet_link(static_cast<int>(i)), lever * (thumb ? parameters_.thumb_factor : 1),
                       joint.mimic->offset, joint.limits.lower, joint.limits.upper});
  }
  if (joints_.empty()) {
    throw std::runtime_error(model.file.string() + ": no joint mimics hand motor '" + synergy_joint +
                             "', expected the fingers' joints");
  }
}

void SoftHand::reset() {
  for (FingerJoint& joint : joints_) {
    body_.bullet().setJointPos(joint.bullet_link, joint.open);
    joint.q = joint.open;
    joint.friction = 0;
  }
  actuator_.reset(0, 0);
  tension_sum_ = tension_ = tension_before_ = 0;
  sub_steps_ = 0;
}

void SoftHand::advance(double wanted_torque, bool locked, double since_step, double dt) {
  double travel = 0;  // m of tendon the fingers have taken up
  double speed = 0;
  for (const FingerJoint& joint : joints_) {
    const double rate = body_.bullet().getJointVel(joint.bullet_link);
    travel += joint.radius * (body_.bullet().getJointPos(joint.bullet_link) + rate * since_step - joint.open);
    speed += joint.radius * rate;
  }
  const double pulley = parameters_.pulley_radius;
  tension_sum_ += actuator_.advance(travel / pulley, speed / pulley, wanted_torque, locked, dt) / pulley;
  ++sub_steps_;
}

void SoftHand::apply() {
  if (sub_steps_ > 0) tension_ = tension_sum_ / sub_steps_;
  tension_sum_ = 0;
  sub_steps_ = 0;
  // A closing finger gets the tension times the efficiency; one that is forced open has to overcome the
  // tension divided by it.
  const double mean = (1 / parameters_.efficiency + parameters_.efficiency) / 2;
  const double most = (1 / parameters_.efficiency - parameters_.efficiency) / 2;
  for (FingerJoint& joint : joints_) {
    const double q = body_.bullet().getJointPos(joint.bullet_link);
    const double rate = body_.bullet().getJointVel(joint.bullet_link);
    const double beyond = q - std::clamp(q, joint.lower, joint.upper);
    // The tendon slides over the pulley when the joint turns and when the tension stretches it.
    const double slid =
        joint.radius * (q - joint.q) + (tension_ - tension_before_) / parameters_.tendon_stiffness;
    const double limit = joint.radius * most * tension_;
    joint.friction =
        std::clamp(joint.friction + joint.radius * parameters_.tendon_stiffness * slid, -limit, limit);
    joint.q = q;
    const double pull = joint.radius * mean * tension_ - joint.friction;
    // In the open posture the joint's own stop takes the pretension.
    const double off_stop = std::clamp((q - joint.open) / kOffTheStop, 0.0, 1.0);
    const double ligament =
        parameters_.return_stiffness * (q - joint.open) + parameters_.return_pretension * off_stop;
    body_.bullet().addJointTorque(joint.bullet_link, pull - ligament - parameters_.stop_stiffness * beyond -
                                                         parameters_.joint_damping * rate);
  }
  tension_before_ = tension_;
}

}  // namespace walkman::plant
