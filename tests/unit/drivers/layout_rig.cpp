#include "tests/unit/drivers/layout_rig.h"

namespace walkman::test {

std::string layout_file(const std::string& layout) {
  return std::string(WALKMAN_URDF_DIR) + "/pdo_layouts/layout_" + layout + ".yaml";
}

void LayoutRig::add_joint(const std::string& name, double lower, double upper, double velocity,
                          double effort) {
  Joint joint;
  joint.name = name;
  joint.type = JointType::kRevolute;
  joint.limits = {lower, upper, velocity, effort};
  model.joints.push_back(joint);
}

void LayoutRig::add_device(std::size_t bus, DeviceKind kind, std::uint8_t id, const std::string& name,
                           std::uint32_t rated) {
  Device device;
  device.kind = kind;
  device.node_id = id;
  device.name = name;
  device.rated_torque_mnm = rated;
  table.buses[bus].devices.push_back(device);
}

LayoutRig::LayoutRig(const std::string& layout)
    : drive(11, layout == "d"),
      sensor(18, layout == "d"),
      hand(19, layout == "d"),
      waist(31, layout == "d"),
      imu(91, layout == "d") {
  model.name = "small_robot";
  add_joint("RShSag", -1.5, 1.5, 6.283, 120);
  add_joint("r_handj", 0, 5, 4, 5);
  add_joint("WaistYaw", -1.5, 1.5, 6.283, 120);
  table.buses.resize(2);
  table.buses[0].name = "rarm";
  table.buses[1].name = "torso";
  add_device(0, DeviceKind::kJointDrive, 11, "RShSag", 120000);
  add_device(0, DeviceKind::kForceTorque, 18, "r_arm_ft", 0);
  add_device(0, DeviceKind::kHandDrive, 19, "r_handj", 5000);
  add_device(1, DeviceKind::kJointDrive, 31, "WaistYaw", 120000);
  add_device(1, DeviceKind::kInertialUnit, 91, "imu_link", 0);
  drive.become_drive(120000, 10'000'000);
  hand.become_drive(5000, 50'000);
  waist.become_drive(120000, 10'000'000);
  sensor.become_sensor(6);
  imu.become_sensor(10);
  drive.set(0x6064, 0, 500000);
  imu.set(0x7130, 7, 30000);
  for (DictionaryNode* node : {&drive, &sensor, &hand}) rarm.attach(*node);
  for (DictionaryNode* node : {&waist, &imu}) torso.attach(*node);
  rarm.fd = torso.fd = layout == "d";
  options.layout = robot::load_pdo_layout(layout_file(layout));
  rebuild();
}

void LayoutRig::rebuild() {
  robot = std::make_unique<robot::Robot>(model, table, std::vector<can::Interface*>{&rarm, &torso}, options);
}

bool LayoutRig::boot(int limit) {
  for (int i = 0; i < limit; ++i) {
    now += options.cycle;
    rarm.tick(now);
    torso.tick(now);
    if (!robot->boot(now)) continue;
    robot->read(now);
    robot->sync(now);
    return true;
  }
  return false;
}

bool LayoutRig::recover(int limit) {
  for (int i = 0; i < limit; ++i) {
    now += options.cycle;
    rarm.tick(now);
    torso.tick(now);
    if (!robot->recover(now)) continue;
    robot->read(now);
    robot->sync(now);
    return true;
  }
  return false;
}

bool LayoutRig::cycle() {
  now += options.cycle;
  rarm.tick(now);
  torso.tick(now);
  const bool good = robot->read(now);
  if (!commands.empty()) robot->write(commands);
  robot->sync(now);
  return good;
}

bool LayoutRig::cycles(int count) {
  bool good = true;
  for (int i = 0; i < count; ++i) good = cycle() && good;
  return good;
}

int LayoutRig::cycles_to_fault(int limit) {
  for (int i = 1; i <= limit; ++i) {
    if (!cycle()) return i;
  }
  return -1;
}

std::string LayoutRig::refusals() const {
  std::string all;
  for (const DictionaryNode* node : {&drive, &sensor, &hand, &waist, &imu}) {
    for (const std::string& refusal : node->refusals) all += refusal + "\n";
  }
  return all;
}

}  // namespace walkman::test
