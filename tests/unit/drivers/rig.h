#pragma once

#include <memory>

#include "drivers/robot/robot.h"
#include "tests/unit/drivers/fake_node.h"

namespace walkman::test {

/// A minimal right arm: drive RShSag (node 11, 120 N·m, limits -1.5..1.5 rad), wrist sensor r_arm_ft (18),
/// hand r_handj (19, 5 N·m, 0..5 rad, 4 rad/s), all on can_rarm. The model and table are built here, not
/// loaded.
class Rig {
 public:
  Rig();

  /// Fills in the scripts of a flawless boot, with the TPDOs of `drive_tpdos`, `sensor_tpdos` and
  /// `hand_tpdos`.
  void script_all();
  void script_drive();
  void script_sensor();
  void script_hand();

  /// Calls boot once per cycle until it returns true or `limit` cycles have passed.
  bool boot(int limit = 200);
  /// Runs one cycle: advances by 5 ms, reads, writes `commands` if not empty, syncs. Returns what `read`
  /// returned.
  bool cycle();
  bool cycles(int count);

  [[nodiscard]] std::string complaints() const;
  [[nodiscard]] std::string fault_text() const;

  RobotModel model;
  DeviceTable table;
  robot::RobotOptions options;
  FakeBus bus{"can_rarm"};
  FakeNode drive{11}, sensor{18}, hand{19};
  std::unique_ptr<robot::Robot> robot;
  Time now = std::chrono::seconds(10);
  std::vector<robot::JointCommand> commands;

  // Bytes of the TPDOs in operation. Drive: enabled, csp, torque 250 per mille = 30 N·m; 0.5 rad, -0.01
  // rad/s.
  std::string drive_tpdo1 = "18B#37 12 08 FA 00";
  std::string drive_tpdo2 = "28B#20 A1 07 00 F0 D8 FF FF";

  /// Rebuilds the robot with changed options; to be called before `boot` only.
  void rebuild();

 private:
  void add_joint(const std::string& name, double lower, double upper, double velocity, double effort);
};

/// The drive's conversation up to NMT start, as literal bytes for node-ID 11, rated torque 120 000 mN·m,
/// spring 10 000 N·m/rad.
inline constexpr const char* kDriveConversation[][2] = {
    {"60B#40 00 10 00 00 00 00 00", "58B#43 00 10 00 92 01 02 00"},  // device type
    {"60B#40 18 10 01 00 00 00 00", "58B#43 18 10 01 5A 02 00 00"},  // vendor-ID
    {"60B#40 76 60 00 00 00 00 00", "58B#43 76 60 00 C0 D4 01 00"},  // rated torque
    {"60B#40 20 20 03 00 00 00 00", "58B#43 20 20 03 80 96 98 00"},  // spring constant
    {"60B#2F C2 60 01 05 00 00 00", "58B#60 C2 60 01 00 00 00 00"},  // 5
    {"60B#2F C2 60 02 FD 00 00 00", "58B#60 C2 60 02 00 00 00 00"},  // times 10^-3 s
    {"60B#2B 17 10 00 64 00 00 00", "58B#60 17 10 00 00 00 00 00"},  // heartbeat every 100 ms
    {"60B#23 16 10 01 FA 00 7F 00", "58B#60 16 10 01 00 00 00 00"},  // watch node 127, 250 ms
    {"60B#2B 00 14 05 64 00 00 00", "58B#60 00 14 05 00 00 00 00"},  // RPDO1's deadline, 100 ms
    {"60B#2B 01 14 05 64 00 00 00", "58B#60 01 14 05 00 00 00 00"},  // RPDO2's
    {"60B#2B 07 60 00 03 00 00 00", "58B#60 07 60 00 00 00 00 00"},  // quick stop on loss
    {"60B#2B 72 60 00 E8 03 00 00", "58B#60 72 60 00 00 00 00 00"},  // max torque 1000 per mille
};

/// The hand's PDOs are sent with every n-th SYNC: more slowly than the joints', so that both rates are
/// tested.
inline constexpr std::uint8_t kHandSyncs = 4;

/// The same for the hand: node-ID 19, 5 000 mN·m, spring 50 N·m/rad, a set-point every fourth SYNC.
inline constexpr const char* kHandConversation[][2] = {
    {"613#40 00 10 00 00 00 00 00", "593#43 00 10 00 92 01 02 00"},
    {"613#40 18 10 01 00 00 00 00", "593#43 18 10 01 5A 02 00 00"},
    {"613#40 76 60 00 00 00 00 00", "593#43 76 60 00 88 13 00 00"},
    {"613#40 20 20 03 00 00 00 00", "593#43 20 20 03 50 C3 00 00"},
    {"613#2F C2 60 01 14 00 00 00", "593#60 C2 60 01 00 00 00 00"},
    {"613#2F C2 60 02 FD 00 00 00", "593#60 C2 60 02 00 00 00 00"},
    {"613#2B 17 10 00 64 00 00 00", "593#60 17 10 00 00 00 00 00"},
    {"613#23 16 10 01 FA 00 7F 00", "593#60 16 10 01 00 00 00 00"},
    {"613#2B 00 14 05 64 00 00 00", "593#60 00 14 05 00 00 00 00"},
    {"613#2B 01 14 05 64 00 00 00", "593#60 01 14 05 00 00 00 00"},
    {"613#2B 07 60 00 03 00 00 00", "593#60 07 60 00 00 00 00 00"},
    {"613#2B 72 60 00 E8 03 00 00", "593#60 72 60 00 00 00 00 00"},
};

/// The sensor: node-ID 18, forces with one decimal digit, torques with two.
inline constexpr const char* kSensorConversation[][2] = {
    {"612#40 00 10 00 00 00 00 00", "592#43 00 10 00 94 01 02 00"},
    {"612#40 18 10 01 00 00 00 00", "592#43 18 10 01 5A 02 00 00"},
    {"612#2B 17 10 00 64 00 00 00", "592#60 17 10 00 00 00 00 00"},
    {"612#23 16 10 01 FA 00 7F 00", "592#60 16 10 01 00 00 00 00"},
    {"612#40 32 61 01 00 00 00 00", "592#4F 32 61 01 01 00 00 00"},
    {"612#40 32 61 02 00 00 00 00", "592#4F 32 61 02 01 00 00 00"},
    {"612#40 32 61 03 00 00 00 00", "592#4F 32 61 03 01 00 00 00"},
    {"612#40 32 61 04 00 00 00 00", "592#4F 32 61 04 02 00 00 00"},
    {"612#40 32 61 05 00 00 00 00", "592#4F 32 61 05 02 00 00 00"},
    {"612#40 32 61 06 00 00 00 00", "592#4F 32 61 06 02 00 00 00"},
};

/// TPDOs of the sensor with the counter of SYNC `n`: force (10.0, -20.0, 30.0) N, torque (1.00, -2.00, 3.00)
/// N·m.
[[nodiscard]] FakeNode::Frames sensor_tpdos(int n, const std::string& status = "00");

}  // namespace walkman::test
