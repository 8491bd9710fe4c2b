#include "emulator/scene/robot_parts.h"

#include "urdf/reader/kinematics.h"

namespace walkman {

RobotParts::RobotParts(const RobotModel& robot, const DeviceTable& devices) {
  const std::size_t count = robot.links.size();
  const auto carrier = [&](std::size_t link) -> const Joint* {
    const int joint = robot.links[link].parent_joint;
    return joint < 0 ? nullptr : &robot.joints[static_cast<std::size_t>(joint)];
  };
  std::vector<std::size_t> parents;  // of each link; the root's own index for the root
  for (std::size_t i = 0; i < count; ++i)
    parents.push_back(carrier(i) == nullptr ? i : static_cast<std::size_t>(carrier(i)->parent_link));

  std::vector<bool> in_hand(count, false);
  for (const Bus& bus : devices.buses) {
    for (const Device& device : bus.devices) {
      if (device.kind == DeviceKind::kJointDrive) driven_.push_back(device.name);
      if (device.kind != DeviceKind::kForceTorque) continue;
      const auto frame = static_cast<std::size_t>(robot.link_index(device.name));
      Hand hand{device.name, {}, links_below(robot, frame)};
      hand.links.erase(hand.links.begin());
      for (std::size_t j = 0; j < robot.joints.size(); ++j)
        if (robot.joints[j].parent_link == static_cast<int>(frame)) hand.mountings.push_back(j);
      for (const std::size_t link : hand.links) in_hand[link] = true;
      if (!hand.links.empty()) {
        hands_.push_back(std::move(hand));
      } else {
        feet_.push_back(parents[frame]);
      }
    }
  }

  std::vector<std::size_t> body(count), branches(count, 0);  // by the first link of a rigid body
  for (std::size_t i = 0; i < count; ++i) {
    const Joint* joint = carrier(i);
    const bool moves = joint != nullptr && joint->type != JointType::kFixed;
    body[i] = joint == nullptr || moves ? i : body[parents[i]];
    if (moves && !in_hand[i]) ++branches[body[parents[i]]];
  }
  chain_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const bool begins = parents[i] == i || (body[i] == i && branches[body[parents[i]]] > 1);
    chain_[i] = begins ? i : chain_[parents[i]];
    if (!in_hand[i]) chain_links_.push_back(i);
  }
}

}  // namespace walkman
