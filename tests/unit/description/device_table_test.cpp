#include "urdf/reader/device_table.h"

#include <set>

#include <gmock/gmock.h>

#include "robots.h"

namespace walkman::testing {
namespace {

const DeviceTable& table() {
  static const DeviceTable loaded = load_device_table(kUrdf / "walkman.devices.yaml", walkman_model());
  return loaded;
}

TEST(WalkmanDevices, OneBusALimb) {
  std::vector<std::string> names;
  std::vector<std::size_t> sizes;
  for (const Bus& bus : table().buses) {
    names.push_back(bus.name);
    sizes.push_back(bus.devices.size());
    EXPECT_EQ(bus.interface, "can_" + bus.name);
  }
  EXPECT_THAT(names, ::testing::ElementsAre("torso", "rarm", "larm", "rleg", "lleg"));
  EXPECT_THAT(sizes, ::testing::ElementsAre(6, 9, 9, 7, 7));
}

TEST(WalkmanDevices, EveryActuatedJointHasOneDriveOfItsUrdfEffort) {
  std::set<std::string> driven;
  int hands = 0;
  int sensors = 0;
  int inertial_units = 0;
  for (const Bus& bus : table().buses) {
    for (const Device& device : bus.devices) {
      if (device.kind == DeviceKind::kForceTorque) {
        ++sensors;
        continue;
      }
      if (device.kind == DeviceKind::kInertialUnit) {
        ++inertial_units;
        EXPECT_TRUE(device.actuator.empty());
        continue;
      }
      hands += device.kind == DeviceKind::kHandDrive ? 1 : 0;
      driven.insert(device.name);
      const RobotModel& model = walkman_model();
      const Joint& joint = model.joints[static_cast<std::size_t>(model.joint_index(device.name))];
      EXPECT_DOUBLE_EQ(device.rated_torque_mnm, joint.limits.effort * 1000) << device.name;
    }
  }
  EXPECT_EQ(hands, 2);
  EXPECT_EQ(sensors, 4);
  EXPECT_EQ(inertial_units, 1);
  for (const Joint& joint : walkman_model().joints)
    EXPECT_EQ(driven.count(joint.name) > 0, joint.type == JointType::kRevolute && !joint.mimic) << joint.name;
}

TEST(WalkmanDevices, NodesAreTheBoardIds) {
  const std::pair<const char*, int> expected[] = {
      {"NeckPitchj", 1}, {"WaistYaw", 31}, {"WaistLat", 33},        {"RShSag", 11},  {"RWrj2", 17},
      {"r_arm_ft", 18},  {"LElbj", 24},    {"l_handj_synergy", 29}, {"RHipLat", 41}, {"r_leg_ft", 47},
      {"LAnkLat", 56},   {"l_leg_ft", 57}, {"imu_link", 91}};
  for (const auto& [name, node] : expected) EXPECT_EQ(table().device(name).node_id, node) << name;
  EXPECT_EQ(table().device("WaistLat").actuator, "medium");
  EXPECT_EQ(table().device("RHipYaw").actuator, "medium2");
  EXPECT_EQ(table().device("LKneeSag").actuator, "big");
  EXPECT_EQ(table().device("LWrj1").actuator, "small");
  EXPECT_THROW((void)table().device("gripper"), std::out_of_range);
}

TEST(WalkmanDevices, BusesAreClassicalAt1MbitUnlessTheTableSaysOtherwise) {
  for (const Bus& bus : table().buses) {
    EXPECT_EQ(bus.bit_rate, 1'000'000U);
    EXPECT_FALSE(bus.fd);
  }
  const DeviceTable fd = load_device_table(kData / "devices_fd.yaml", walkman_model());
  EXPECT_EQ(fd.buses.at(0).bit_rate, 500'000U);
  EXPECT_TRUE(fd.buses.at(0).fd);
  EXPECT_EQ(fd.buses.at(0).data_bit_rate, 8'000'000U);
}

}  // namespace
}  // namespace walkman::testing
