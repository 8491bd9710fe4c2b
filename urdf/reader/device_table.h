#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "urdf/reader/robot_model.h"

namespace walkman {

enum class DeviceKind { kJointDrive, kHandDrive, kForceTorque, kInertialUnit };

/// Names of a kind of device in files.
struct DeviceKindName {
  DeviceKind kind;
  const char* key;   ///< in a device table: the key whose value is the URDF joint or frame
  const char* name;  ///< in identities and PDO layouts
  bool drive;        ///< drives a joint of the URDF; otherwise it measures in a frame
};

/// All kinds of devices.
inline constexpr DeviceKindName kDeviceKinds[] = {
    {DeviceKind::kJointDrive, "joint", "joint_drive", true},
    {DeviceKind::kHandDrive, "hand", "hand_drive", true},
    {DeviceKind::kForceTorque, "force_torque", "force_torque", false},
    {DeviceKind::kInertialUnit, "imu", "imu", false},
};

/// One CANopen node of the robot: its kind, its place, and the part of the URDF that it drives or measures.
struct Device {
  DeviceKind kind = DeviceKind::kJointDrive;
  std::uint8_t node_id =
      0;  ///< 1..126 (127 is the master's), equal to the robot's board ID, unique over the whole robot
  std::string name;      ///< URDF joint (drives) or URDF frame (sensors)
  std::string actuator;  ///< actuator class of a drive, e.g. "medium2"; empty for sensors
  std::string sensor;    ///< kind of a force/torque sensor, e.g. "force_torque_45mm"; else empty
  std::uint32_t rated_torque_mnm = 0;  ///< 6076h of a drive, mN·m
};

struct Bus {
  std::string name;  ///< e.g. "rarm"
  std::string
      interface;  ///< name in logs and default network interface, e.g. "can_rarm", at most 15 characters
  std::vector<Device> devices;
  std::uint32_t bit_rate = 1'000'000;       ///< bit/s: 1000, 800, 500, 250 or 125 kbit/s (CiA 301)
  bool fd = false;                          ///< PDOs may be CAN FD frames with bit-rate switch
  std::uint32_t data_bit_rate = 5'000'000;  ///< of their data phase, bit/s: 1, 2, 4, 5 or 8 Mbit/s
};

/// Returns why a text cannot be the name of a network interface, by the rules of Linux (dev_valid_name) and
/// in printable ASCII, or nullopt if it can.
[[nodiscard]] std::optional<std::string> interface_name_problem(std::string_view name);

/// Assignment of devices to buses and node-IDs. Both ends of the wire read it, as a real robot's computer and
/// its wiring plan both would.
struct DeviceTable {
  std::vector<Bus> buses;

  [[nodiscard]] const Device& device(const std::string& name) const;  ///< throws std::out_of_range
};

/// Reads the YAML table and checks it against the model: known joints and frames, node-IDs 1..126 each used
/// once, CiA bit rates, names of buses and interfaces that are valid interface names (a bus's name is also
/// used as a file name). Throws std::runtime_error with file, line and key.
[[nodiscard]] DeviceTable load_device_table(const std::filesystem::path& yaml_file, const RobotModel& model);

}  // namespace walkman
