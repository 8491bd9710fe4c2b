#include "tests/unit/drivers/rig.h"

#include "drivers/cia402/drive_mapping.h"

namespace walkman::test {
namespace {

using std::chrono::milliseconds;

template <typename Conversation>
void script_configuration(FakeNode& node, const std::string& boot_up, const Conversation& conversation) {
  node.expect("000#82 00").answer(boot_up);
  for (const auto& [request, response] : conversation) node.expect(request).answer(response);
  node.expect("000#01 00");
}

Device device(DeviceKind kind, std::uint8_t id, const std::string& name, std::uint32_t rated) {
  Device result;
  result.kind = kind;
  result.node_id = id;
  result.name = name;
  result.rated_torque_mnm = rated;
  return result;
}

}  // namespace

FakeNode::Frames sensor_tpdos(int n, const std::string& status) {
  can::Frame forces = frame("192#64 00 38 FF 2C 01 00 00");
  forces.data[6] = static_cast<std::uint8_t>(n);
  forces.data[7] = static_cast<std::uint8_t>(n >> 8);
  return {forces, frame("292#64 00 38 FF 2C 01 " + status)};
}

void Rig::add_joint(const std::string& name, double lower, double upper, double velocity, double effort) {
  Joint joint;
  joint.name = name;
  joint.type = JointType::kRevolute;
  joint.limits = {lower, upper, velocity, effort};
  model.joints.push_back(joint);
}

Rig::Rig() {
  model.name = "small_arm";
  add_joint("RShSag", -1.5, 1.5, 6.283, 120);
  add_joint("r_handj", 0, 5, 4, 5);
  walkman::Bus arm;
  arm.name = "rarm";
  arm.interface = "can_rarm";
  arm.devices = {device(DeviceKind::kJointDrive, 11, "RShSag", 120000),
                 device(DeviceKind::kForceTorque, 18, "r_arm_ft", 0),
                 device(DeviceKind::kHandDrive, 19, "r_handj", 5000)};
  table.buses.push_back(arm);
  options.layout.kinds[DeviceKind::kHandDrive] = cia402::factory_drive_pdos(kHandSyncs);
  bus.attach(drive);
  bus.attach(sensor);
  bus.attach(hand);
  rebuild();
}

void Rig::rebuild() {
  robot = std::make_unique<robot::Robot>(model, table, std::vector<can::Interface*>{&bus}, options);
}

void Rig::script_drive() {
  script_configuration(drive, "70B#00", kDriveConversation);
  drive.every(milliseconds(100), "70B#05")
      .each_sync({"18B#50 02 08 FA 00", drive_tpdo2})
      .await("20B#06 00 08 00 00")
      .each_sync({"18B#31 02 08 FA 00", drive_tpdo2})
      .await("20B#07 00 08 00 00")
      .each_sync({"18B#33 02 08 FA 00", drive_tpdo2})
      .await("20B#0F 00 08 00 00")
      .each_sync([this](int) {
        return FakeNode::Frames{frame(drive_tpdo1), frame(drive_tpdo2)};
      });
}

void Rig::script_sensor() {
  script_configuration(sensor, "712#00", kSensorConversation);
  sensor.every(milliseconds(100), "712#05").each_sync([](int n) { return sensor_tpdos(n); });
}

void Rig::script_hand() {
  script_configuration(hand, "713#00", kHandConversation);
  const auto every_fourth = [](const std::string& statusword) {
    return [statusword](int n) -> FakeNode::Frames {
      if (n % 4 != 1) return {};
      return {frame("193#" + statusword + " 08 00 00"), frame("293#40 42 0F 00 00 00 00 00")};
    };
  };
  hand.every(milliseconds(100), "713#05")
      .each_sync(every_fourth("50 02"))
      .await("213#06 00 08 00 00")
      .each_sync(every_fourth("31 02"))
      .await("213#07 00 08 00 00")
      .each_sync(every_fourth("33 02"))
      .await("213#0F 00 08 00 00")
      .each_sync(every_fourth("37 12"));
}

void Rig::script_all() {
  script_drive();
  script_sensor();
  script_hand();
}

bool Rig::boot(int limit) {
  for (int i = 0; i < limit; ++i) {
    now += options.cycle;
    bus.tick(now);
    if (robot->boot(now)) {
      robot->read(now);
      robot->sync(now);
      return true;
    }
  }
  return false;
}

bool Rig::cycle() {
  now += options.cycle;
  bus.tick(now);
  const bool good = robot->read(now);
  if (!commands.empty()) robot->write(commands);
  robot->sync(now);
  return good;
}

bool Rig::cycles(int count) {
  bool good = true;
  for (int i = 0; i < count; ++i) good = cycle() && good;
  return good;
}

std::string Rig::complaints() const {
  std::string all;
  for (const FakeNode* node : {&drive, &sensor, &hand}) {
    for (const std::string& complaint : node->complaints()) all += complaint + "\n";
    if (!node->done()) all += "script not finished\n";
  }
  return all;
}

std::string Rig::fault_text() const { return robot->fault() ? robot->fault()->text : "none"; }

}  // namespace walkman::test
