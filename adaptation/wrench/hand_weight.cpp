#include "adaptation/wrench/hand_weight.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "urdf/reader/kinematics.h"

namespace walkman::wrench {

HandWeight::HandWeight(const RobotModel& model, const std::string& sensor_frame)
    : model_(&model), sensor_link_(model.link_index(sensor_frame)) {
  for (const std::size_t i : links_below(model, static_cast<std::size_t>(sensor_link_))) {
    if (model.links[i].mass <= 0) continue;
    links_.push_back(static_cast<int>(i));
    mass_ += model.links[i].mass;
  }
  if (links_.empty()) {
    throw std::runtime_error(model.file.string() + ": nothing with mass is attached to force/torque frame '" +
                             sensor_frame + "', expected a hand");
  }
}

void HandWeight::hold(const std::string& hand_link, std::vector<motion::Grip::Phalanx> fingers) {
  fingers_ = std::move(fingers);
  if (!fingers_.empty()) hand_link_ = model_->link_index(hand_link);
}

Wrench HandWeight::F_So_S(const motion::KinematicTree& posed) const {
  const Eigen::Isometry3d& X_WS = posed.X_WL(sensor_link_);
  Wrench F_So_W;
  for (const int i : links_) {
    const Link& link = posed.model().links[static_cast<std::size_t>(i)];
    const Eigen::Vector3d weight(0, 0, -link.mass * motion::kGravity);
    F_So_W.force += weight;
    const auto held =
        std::find_if(fingers_.begin(), fingers_.end(), [&](const auto& f) { return f.link == i; });
    const Eigen::Vector3d p_WLcm = held == fingers_.end()
                                       ? Eigen::Vector3d(posed.X_WL(i) * link.p_LLcm)
                                       : Eigen::Vector3d(posed.X_WL(hand_link_) * (held->X_HL * link.p_LLcm));
    F_So_W.torque += (p_WLcm - X_WS.translation()).cross(weight);
  }
  const Eigen::Matrix3d R_SW = X_WS.linear().transpose();
  return {R_SW * F_So_W.torque, R_SW * F_So_W.force};
}

}  // namespace walkman::wrench
