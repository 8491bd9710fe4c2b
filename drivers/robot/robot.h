#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/can/interface.h"
#include "drivers/cia402/joint_drive.h"
#include "drivers/cia404/force_torque_sensor.h"
#include "drivers/robot/boot.h"
#include "drivers/robot/fault.h"
#include "drivers/robot/robot_bus.h"
#include "drivers/robot/robot_options.h"
#include "urdf/reader/device_table.h"
#include "urdf/reader/robot_model.h"

namespace walkman::robot {

/// Set-point of one drive for the next SYNC.
struct JointCommand {
  /// rad, URDF joint coordinate; the driver adds the spring's deflection at `feedforward_torque`.
  double link_position = 0;
  double feedforward_torque = 0;  ///< expected static torque on the link, N·m
};

/// Totals since construction, over all buses.
struct Counters {
  std::uint64_t syncs = 0;  ///< cycles with SYNC
  std::uint64_t frames_received = 0;
  std::uint64_t frames_ignored = 0;      ///< of those: unknown sender, wrong kind or wrong length
  std::uint64_t foreign_frames = 0;      ///< of those: frames only a master sends, so a second one exists
  std::uint64_t frames_not_sent = 0;     ///< refused by an interface; the next cycle sends newer values
  std::uint64_t receive_overflows = 0;   ///< lost in receive queues
  std::uint64_t emergencies = 0;         ///< EMCY with an error code
  std::uint64_t controller_reports = 0;  ///< error frames of the computer's own controllers
};

/// View of the newest samples of the devices of one class, in table order.
template <typename DeviceClass>
class Samples {
 public:
  class Iterator {
   public:
    explicit Iterator(DeviceClass* const* at) noexcept : at_(at) {}
    [[nodiscard]] const auto& operator*() const noexcept { return (*at_)->sample(); }
    Iterator& operator++() noexcept {
      ++at_;
      return *this;
    }
    friend bool operator==(const Iterator&, const Iterator&) = default;

   private:
    DeviceClass* const* at_;
  };

  explicit Samples(const std::vector<DeviceClass*>& devices) noexcept : devices_(devices) {}

  [[nodiscard]] std::size_t size() const noexcept { return devices_.size(); }
  [[nodiscard]] const auto& operator[](std::size_t place) const noexcept { return devices_[place]->sample(); }
  [[nodiscard]] const auto& front() const noexcept { return (*this)[0]; }
  [[nodiscard]] Iterator begin() const noexcept { return Iterator(devices_.data()); }
  [[nodiscard]] Iterator end() const noexcept { return Iterator(devices_.data() + devices_.size()); }

 private:
  std::span<DeviceClass* const> devices_;
};

/// The robot as seen by its control computer: every device of a device table, over one CAN interface per bus.
/// Has no thread and no clock. Once booted, `read`, `write` and `sync` neither allocate nor throw.
class Robot {
 public:
  /// `interfaces` in the order of `table.buses`; they must outlive the robot.
  /// Throws std::runtime_error if a drive's joint is not in the model, a node-ID is used twice on a bus, or
  /// the number of interfaces or the options do not fit.
  Robot(const RobotModel& model, const DeviceTable& table, const std::vector<can::Interface*>& interfaces,
        const RobotOptions& options = {});
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;

  /// Brings every node from power-on to operational and every drive to operation enabled, holding position.
  /// Call once per cycle, with `now` advancing, until it returns true; it sends SYNC itself in every call
  /// that returns false. The call that returns true sends nothing: `read`, `write` and `sync` take over in
  /// that cycle. All nodes of all buses are configured at the same time; then NMT start, then the drives'
  /// power-up. After `stop`, and when called after a fault, it starts over from NMT reset communication.
  /// Throws std::runtime_error with node, object and reason if a node does not come up.
  bool boot(Time now);

  /// Restores what a fault disabled, and only that. A bus is rebooted, from NMT reset communication, if one
  /// of its nodes booted up unexpectedly, left NMT operational or fell silent, or if the link was down or
  /// bus-off; if a link is still broken, it waits. On the other buses, drives that left operation enabled are
  /// brought back to it, out of a fault by rising edges of fault reset; everything else keeps holding its
  /// position. Call like `boot`, once per cycle until it returns true; it has then cleared the fault. Without
  /// a fault it does nothing and returns true; on a robot that is not booted it acts as `boot`. Throws
  /// std::runtime_error with node and reason if something does not come back within the boot time-out; the
  /// rest still holds, the fault stays, and recovery may be tried again.
  bool recover(Time now);

  /// Processes the frames received so far without judging: for lock-step, between `sync` and the next `read`.
  void collect(Time now) noexcept;

  /// In lock-step: whether everything triggered by the SYNCs sent so far has arrived: the due TPDOs of every
  /// started node, the answers to SDO requests sent before the last SYNC, the boot-up after an NMT reset.
  /// What repeatedly fails to arrive is no longer waited for; judging that is left to `read`.
  [[nodiscard]] bool cycle_complete() const noexcept;

  /// Processes all received frames and judges ages and states. Returns false once a fault is latched; from
  /// then on the drives hold their last set-points and `write` has no effect until `recover` or `boot`.
  bool read(Time now) noexcept;

  /// Stores set-points, in the order of `joint_names`; sent by the next `sync`.
  /// Values outside position limits are clamped, and steps faster than the velocity limit are shortened: the
  /// set-point then continues in the following cycles. A value that is not finite, or a wrong number of
  /// commands, is a fault and leaves the set-points unchanged.
  void write(const std::vector<JointCommand>& commands) noexcept;

  /// Commands a hand drive: `hand` is an index into `hand_names`; `closure` is 0 (open) .. 1 (closed) of the
  /// motor's travel, `torque_limit` 0..1 of rated torque.
  /// Values outside are clamped; a value that is not finite, or a hand that does not exist, is a fault.
  void write_hand(int hand, double closure, double torque_limit) noexcept;

  /// Sends SYNC on every bus, then the set-points as RPDOs; the devices take them at the next SYNC.
  void sync(Time now) noexcept;

  /// Queues quick stop for every drive and NMT stop for every bus. Call `sync` once more: it resends an NMT
  /// stop that a queue refused, and in lock-step its SYNC makes the stop happen.
  void stop() noexcept;

  /// Newest samples of the body's drives, of the hands' drives and of the force/torque sensors; element i
  /// belongs to name i; table order. Views of the devices' own samples, valid as long as the robot.
  [[nodiscard]] auto joints() const noexcept { return Samples(joints_); }
  [[nodiscard]] auto hands() const noexcept { return Samples(hands_); }
  [[nodiscard]] auto sensors() const noexcept { return Samples(sensors_); }
  [[nodiscard]] const std::vector<std::string>& joint_names() const noexcept { return joint_names_; }
  [[nodiscard]] const std::vector<std::string>& hand_names() const noexcept { return hand_names_; }
  [[nodiscard]] const std::vector<std::string>& sensor_names() const noexcept { return sensor_names_; }

  /// The device of a class by its URDF joint or frame, e.g. `find<cia404::InertialUnit>("imu_link")`; null if
  /// there is none. Valid as long as the robot; for set-up, not for the cycle.
  template <typename DeviceClass>
  [[nodiscard]] const DeviceClass* find(const std::string& name) const {
    return dynamic_cast<const DeviceClass*>(find_device(name));
  }

  /// The latched fault. Its text is created on the first call, outside the cycle.
  [[nodiscard]] const std::optional<Fault>& fault() const;
  [[nodiscard]] Counters counters() const noexcept;
  /// Warnings about conditions that are not faults, one sentence each, each reported only once: controllers
  /// with raised error counters, drives with their warning bit set, buses flooded by others, another master's
  /// commands with their COB-IDs. Call once per cycle; allocates only if there is something new.
  [[nodiscard]] std::vector<std::string> new_warnings();

 private:
  enum class State { kIdle, kBooting, kRunning, kStopped };

  void add(const RobotModel& model, const Device& device, const Bus& bus, RobotBus& robot_bus);
  [[nodiscard]] const canopen::RemoteNode* find_device(const std::string& name) const noexcept;
  [[nodiscard]] canopen::NodeSettings node_settings(const Device& device, const RobotBus& bus) const;

  bool step(Time now);
  void receive(Time now) noexcept;
  void judge(Time now) noexcept;
  [[nodiscard]] FaultRecord of_all_buses(const FaultRecord& record, Time now) const noexcept;
  void latch(const FaultRecord& candidate) noexcept;
  void latch_command(const canopen::FaultCause& cause, const canopen::RemoteNode* device) noexcept;
  void send_cycle(Time now) noexcept;

  RobotOptions options_;
  std::vector<std::unique_ptr<RobotBus>> buses_;
  std::vector<cia402::JointDrive*> joints_, hands_;
  std::vector<cia404::ForceTorqueSensor*> sensors_;
  std::vector<std::string> joint_names_, hand_names_, sensor_names_;
  Boot boot_{buses_, options_};

  State state_ = State::kIdle;
  Time now_{};
  Time read_at_ = Time::min();  // time of the last `read` of a running robot
  std::uint64_t syncs_ = 0;
  std::optional<FaultRecord> fault_;
  mutable std::optional<Fault> described_;
};

}  // namespace walkman::robot
