#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/canopen/master.h"
#include "drivers/cia402/joint_drive.h"
#include "drivers/cia404/force_torque_sensor.h"
#include "drivers/cia404/inertial_unit.h"
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
  BusSlot(can::Interface& interface, const RobotOptions& options)
      : master(interface, options.heartbeat_producer,
               static_cast<std::uint8_t>(options.sync_counter_overflow)) {}
  canopen::Master master;
  std::vector<DriveSlot*> drives;           // table order
  std::vector<canopen::RemoteNode*> nodes;  // table order
  std::vector<ft::ForceTorqueSensor*> sensors;
  std::vector<imu::InertialUnit*> imus;
  bool commanded = false;      // the NMT command of the present phase has been sent
  bool reset = false;          // is booted from NMT reset in the boot under way
  bool power_up = false;       // its drives are walked up in the boot under way
  bool link_was_lost = false;  // since the last boot of this bus
};

struct Robot::Impl {
  enum class Phase { kIdle, kResetting, kConfiguring, kStarting, kPoweringUp, kRunning, kStopped };

  Impl(const RobotModel& model, const DeviceTable& table, const std::vector<can::Interface*>& interfaces,
       const RobotOptions& given);

  void add_drive(const RobotModel& model, const Device& device, BusSlot& bus);
  void add_sensor(const Device& device, BusSlot& bus);
  void add_inertial_unit(const Device& device, BusSlot& bus);
  void add_node(canopen::RemoteNode& node, BusSlot& bus);
  [[nodiscard]] canopen::NodeSettings node_settings(const Device& device, const BusSlot& bus) const;

  bool boot(Time now);
  bool recover(Time now);
  void begin_boot(Time now);
  void begin_recovery(Time now);
  void begin_reset(BusSlot& bus, Time now);
  [[nodiscard]] bool needs_reset(const BusSlot& bus, Time now) const noexcept;
  /// One cycle of a boot or recovery; true when it has ended.
  bool step(Time now);
  void finish_boot(Time now);
  [[nodiscard]] bool command_all(canopen::NmtCommand command) noexcept;
  [[nodiscard]] bool configure_all(Time now);
  [[nodiscard]] bool power_up_all();
  void begin_power_up() noexcept;
  void check_links(Time now);
  void check_boot_progress(Time now) const;
  void check_the_others(Time now) const;
  [[nodiscard]] std::string what_is_missing(const canopen::RemoteNode& node) const;
  [[nodiscard]] bool booting() const noexcept {
    return phase != Phase::kIdle && phase != Phase::kRunning && phase != Phase::kStopped;
  }

  void receive(Time now) noexcept;
  void take_states(Time now) noexcept;
  void judge(Time now) noexcept;
  [[nodiscard]] std::optional<FaultRecord> judge(const BusSlot& bus, Time now) const noexcept;
  [[nodiscard]] bool driving(const BusSlot& bus) const noexcept;
  void send_rpdos(BusSlot& bus) noexcept;
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
  std::vector<std::unique_ptr<imu::InertialUnit>> inertial_units;
  std::vector<std::string> joint_names, hand_names, sensor_names, imu_names;
  std::vector<JointState> joints, hands;
  std::vector<ForceTorqueState> sensors;
  std::vector<InertialState> imus;

  Phase phase = Phase::kIdle;
  bool recovering = false;
  Time phase_began{};
  Time now{};
  std::uint64_t syncs = 0;
  std::optional<FaultRecord> fault;
  mutable std::optional<Fault> described;
};

}  // namespace walkman::robot
