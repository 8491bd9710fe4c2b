#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/canopen/master.h"
#include "drivers/cia402/joint_drive.h"
#include "drivers/ft/force_torque_sensor.h"
#include "drivers/robot/fault_record.h"
#include "drivers/robot/robot.h"
#include "drivers/robot/set_point.h"
#include "drivers/robot/watchdog.h"

namespace walkman::robot {

/// A drive, what it may be told, and where its state is published.
struct DriveSlot {
  std::unique_ptr<cia402::JointDrive> drive;
  SetPointLimits limits;
  SetPoint set_point;
  JointState* state = nullptr;
};

/// A bus with its master and devices.
struct BusSlot {
  explicit BusSlot(can::Interface& interface, Time heartbeat) : master(interface, heartbeat) {}
  canopen::Master master;
  std::vector<DriveSlot*> drives;           // table order
  std::vector<canopen::RemoteNode*> nodes;  // table order
  bool commanded = false;                   // the NMT command of the present phase has been sent
};

struct Robot::Impl {
  enum class Phase { kIdle, kResetting, kConfiguring, kStarting, kPoweringUp, kRunning, kStopped };

  Impl(const RobotModel& model, const DeviceTable& table, const std::vector<can::Interface*>& interfaces,
       const RobotOptions& given);

  void add_drive(const RobotModel& model, const Device& device, BusSlot& bus);
  void add_sensor(const Device& device, BusSlot& bus);
  [[nodiscard]] canopen::NodeSettings node_settings(const Device& device, const BusSlot& bus) const;

  bool boot(Time now);
  void begin_boot(Time now);
  [[nodiscard]] bool command_all(canopen::NmtCommand command) noexcept;
  [[nodiscard]] bool configure_all(Time now);
  [[nodiscard]] bool power_up_all();
  void check_boot_progress(Time now) const;
  [[nodiscard]] std::string what_is_missing(const canopen::RemoteNode& node) const;

  void receive(Time now) noexcept;
  void take_states(Time now) noexcept;
  void judge(Time now) noexcept;
  void latch(const FaultRecord& candidate) noexcept;
  void advance_set_points() noexcept;
  void send_cycle(Time now) noexcept;
  [[nodiscard]] bool turn_of(const cia402::JointDrive& drive) const noexcept {
    return syncs % static_cast<std::uint64_t>(drive.sync_divider()) == 0;
  }

  RobotOptions options;
  Watchdog watchdog;
  std::vector<std::unique_ptr<BusSlot>> buses;
  std::vector<std::unique_ptr<DriveSlot>> joint_drives, hand_drives;
  std::vector<std::unique_ptr<ft::ForceTorqueSensor>> force_torque;
  std::vector<std::string> joint_names, hand_names, sensor_names;
  std::vector<JointState> joints, hands;
  std::vector<ForceTorqueState> sensors;

  Phase phase = Phase::kIdle;
  Time phase_began{};
  Time now{};
  std::uint64_t syncs = 0;
  std::optional<FaultRecord> fault;
  mutable std::optional<Fault> described;
};

}  // namespace walkman::robot
