#include "adaptation/motion/grip.h"

#include <algorithm>
#include <limits>

#include "urdf/reader/kinematics.h"

namespace walkman::motion {
namespace {

constexpr double kStep = 0.02;            // rad
constexpr int kHalvings = 12;             // of a step
constexpr double kLongerThanAHand = 0.5;  // m, half length of the cylinder

}  // namespace

Grip::Grip(const RobotModel& model, const std::string& hand_link, const std::string& motor) : model_(model) {
  const std::vector<Eigen::Isometry3d> X_RL = link_poses(model, {});
  const Eigen::Isometry3d X_HR = X_RL[static_cast<std::size_t>(model.link_index(hand_link))].inverse();
  static_cast<void>(model.joint_index(motor));  // throws for a name that the model does not have
  const std::vector<BodyShape> shapes = body_shapes(model);
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    const Joint& joint = model.joints[j];
    if (!joint.mimic || joint.mimic->joint != motor) continue;
    Finger finger;
    finger.joint = static_cast<int>(j);
    finger.link = joint.child_link;
    finger.X_PJ = joint.X_PJ;
    for (std::size_t k = 0; k < fingers_.size(); ++k)
      if (fingers_[k].link == joint.parent_link) finger.parent = static_cast<int>(k);
    if (finger.parent < 0)
      finger.X_PJ = X_HR * X_RL[static_cast<std::size_t>(joint.parent_link)] * joint.X_PJ;
    finger.open = joint.mimic->offset;
    finger.closed =
        joint.limits.upper;  // if contact stops another joint, the tendon closes this one to its stop
    for (const BodyShape& shape : shapes)
      if (shape.link == finger.link) finger.shapes.push_back(shape);
    fingers_.push_back(std::move(finger));
  }
}

std::vector<Grip::Phalanx> Grip::around(double radius) const {
  BodyShape handle;
  handle.cylinder = true;
  handle.half = {radius, radius, kLongerThanAHand};
  const Eigen::Isometry3d X_HHandle =
      Eigen::Translation3d(0, kDepth - radius, 0) *
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX());
  std::vector<Phalanx> phalanges;
  for (const Finger& finger : fingers_) {
    const Eigen::Isometry3d X_HJ =
        finger.parent < 0 ? finger.X_PJ
                          : phalanges[static_cast<std::size_t>(finger.parent)].X_HL * finger.X_PJ;
    const Eigen::Vector3d& axis = model_.joints[static_cast<std::size_t>(finger.joint)].axis;
    const auto at = [&](double q) -> Eigen::Isometry3d { return X_HJ * Eigen::AngleAxisd(q, axis); };
    const auto meets = [&](double q) {
      return std::any_of(finger.shapes.begin(), finger.shapes.end(), [&](const BodyShape& shape) {
        return separation(shape, at(q) * shape.X_LS, handle, X_HHandle).distance < 0;
      });
    };
    double q = finger.open;
    while (q < finger.closed && !meets(std::min(q + kStep, finger.closed))) q += kStep;
    q = std::min(q, finger.closed);
    double step = std::min(kStep, finger.closed - q);
    for (int i = 0; i < kHalvings; ++i) {
      step /= 2;
      if (!meets(q + step)) q += step;
    }
    phalanges.push_back({finger.link, at(q)});
  }
  return phalanges;
}

}  // namespace walkman::motion
