#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "drivers/can/interface.h"
#include "drivers/robot/identities.h"
#include "drivers/robot/pdo_layout.h"
#include "urdf/reader/device_table.h"
#include "urdf/reader/wrench.h"

namespace walkman::robot {

/// Newest state of one drive. SI units, joint side of the gearbox.
struct JointState {
  double motor_position = 0;     ///< 6064h: motor-side encoder, reflected to the joint, rad
  double motor_velocity = 0;     ///< 606Ch, or the change of 6064h where no PDO has it, rad/s
  double torque = 0;             ///< 6077h: series-spring torque on the link, N·m
  double link_position = 0;      ///< motor position less the spring's deflection at `torque`, rad
  std::uint16_t statusword = 0;  ///< 6041h
  std::int8_t mode = 0;          ///< 6061h
  Time age = Time::max();        ///< of the oldest of the TPDOs that come with SYNC
};

/// Newest sample of one force/torque sensor: the load on the sensor, about and in the sensor frame.
struct ForceTorqueState {
  Wrench F_So_S;
  std::uint16_t sample_counter = 0;  ///< 2050h; equal for both TPDOs of a sample
  std::uint8_t status = 0;           ///< 6150h: bit 0 invalid, 1 positive, 2 negative overload
  Time age = Time::max();
};

/// Newest sample of one inertial unit, in its own frame S.
struct InertialState {
  Eigen::Vector3d specific_force = Eigen::Vector3d::Zero();    ///< m/s²: acceleration less gravity's
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< rad/s
  Eigen::Quaterniond R_WS = Eigen::Quaterniond::Identity();    ///< orientation in the world
  std::uint16_t sample_counter = 0;                            ///< 2050h
  std::uint8_t status = 0;                                     ///< 6150h: bit 0 invalid
  Time age = Time::max();
};

/// Set-point of one drive for the next SYNC.
struct JointCommand {
  double link_position = 0;       ///< rad; the driver adds the spring's deflection at `feedforward_torque`
  double feedforward_torque = 0;  ///< expected static torque on the link, N·m
};

enum class FaultKind {
  kBootFailed,        ///< no boot-up, wrong identity, SDO abort or time-out while configuring
  kDataStale,         ///< cyclic data older than the limit
  kHeartbeatLost,     ///< no heartbeat within the consumer time
  kUnexpectedBootUp,  ///< boot-up message in operation
  kDriveFault,        ///< statusword fault bit, or left operation enabled unasked
  kNmtState,          ///< left NMT operational unasked
  kEmergency,         ///< EMCY received
  kSensorInvalid,     ///< F/T status bit set
  kNotFinite,         ///< a value that is not a number, or outside what the device can measure
  kLimit,             ///< a command outside joint limits (clamped) by more than the tolerance
  kInterfaceDown,     ///< frames cannot be sent: interface down, queue full for several cycles, frame refused
  kRequestFailed,     ///< an SDO request in operation (tare, torque limit) was refused or not answered
  kBusOff,            ///< the computer's CAN controller is bus-off
  kReceiveOverflow,   ///< received frames were lost because nobody fetched them in time
};

/// The first thing that went wrong. Stays until `Robot::clear_fault`.
struct Fault {
  FaultKind kind{};
  std::string device;  ///< URDF joint or frame
  std::uint8_t node_id = 0;
  Time time{};
  std::string text;  ///< one sentence for people
};

struct RobotOptions {
  Time cycle = std::chrono::milliseconds(5);  ///< SYNC period
  int stale_after_cycles = 3;                 ///< cyclic data older than this many cycles is a fault
  Time heartbeat_producer = std::chrono::milliseconds(100);
  Time heartbeat_timeout = std::chrono::milliseconds(250);
  Time boot_timeout = std::chrono::seconds(5);
  double max_joint_velocity =
      6.0;  ///< rad/s, between consecutive set-points; the URDF's limit where it is lower
  double limit_tolerance = 0.01;  ///< rad beyond a position limit that are clamped without a fault
  PdoLayout layout = factory_layout();
  Identities identities;
  bool allow_overload = false;    ///< take a cycle that the frames of a bus do not fit into, for tests
  int sync_counter_overflow = 0;  ///< 1019h: 2 to 240, SYNC carries a counter; 0: it does not
};

/// Progress of `Robot::tare`.
enum class TareState { kIdle, kBusy, kDone, kFailed };

/// Where one node stands, for people.
struct NodeStatus {
  std::string name;  ///< URDF joint or frame
  std::string interface;
  std::uint8_t node_id = 0;
  std::string state;             ///< e.g. "awaiting boot-up", "configuring 3/10", "operation enabled"
  std::uint16_t error_code = 0;  ///< of the newest EMCY; 0000h when there was none or the node is rid of it
  Time heartbeat_age = Time::max();
};

/// What has passed since construction, over all buses.
struct Counters {
  std::uint64_t syncs = 0;  ///< cycles with SYNC
  std::uint64_t frames_received = 0;
  std::uint64_t frames_ignored = 0;      ///< of those: unknown sender, wrong kind or wrong length
  std::uint64_t foreign_frames = 0;      ///< of those: frames only a master sends, so there is a second one
  std::uint64_t frames_not_sent = 0;     ///< refused by an interface; the next cycle sends newer values
  std::uint64_t receive_overflows = 0;   ///< lost in receive queues
  std::uint64_t emergencies = 0;         ///< EMCY with an error code
  std::uint64_t controller_reports = 0;  ///< error frames of the computer's own controllers
};

/// Where one bus stands.
struct BusStatus {
  std::string interface;
  can::LinkState link = can::LinkState::kActive;  ///< of the computer's controller
  Counters counters;
};

/// The robot as its control computer sees it: every drive and sensor of a device table, over one CAN
/// interface a bus. Holds no thread and no clock. Once booted, `read`, `write` and `sync` neither allocate
/// nor throw.
class Robot {
 public:
  /// `interfaces` in the order of `table.buses`; they must outlive the robot.
  /// Throws std::runtime_error when a drive's joint is not in the model, a node-ID is used twice on a bus, or
  /// the number of interfaces does not fit, or the options do not.
  Robot(const RobotModel& model, const DeviceTable& table, const std::vector<can::Interface*>& interfaces,
        const RobotOptions& options = {});
  ~Robot();
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;

  /// Brings every node from power-on to operational and every drive to operation enabled, holding position.
  /// To be called once a cycle, with `now` advancing, until it returns true; it sends SYNC itself in every
  /// call that returns false. The call that returns true sends nothing: `read`, `write` and `sync` take over
  /// in that cycle. All nodes of all buses are configured at the same time; then NMT start, then the drives'
  /// power-up. After `stop` it begins anew, from NMT reset communication; so it also does when called after a
  /// fault. Throws std::runtime_error with node, object and reason when a node does not come up.
  bool boot(Time now);

  /// Brings back what a fault took away, and only that. A bus is booted anew, from NMT reset communication,
  /// when one of its nodes booted up unasked, left NMT operational, fell silent, or when the link was down or
  /// bus-off; for a link that is still broken it waits. On the other buses drives that left operation enabled
  /// are walked up again, a fault by rising edges of fault reset; everything else goes on holding its
  /// position. To be called like `boot`, once a cycle until it returns true; it then has cleared the fault.
  /// Without a fault it does nothing and returns true; on a robot that is not booted it is `boot`. Throws
  /// std::runtime_error with node and reason when something does not come back within the boot time-out; the
  /// rest still holds, the fault stays, and it may be tried again.
  bool recover(Time now);

  /// Takes in what was received so far without judging it: for lock-step, between `sync` and the next `read`.
  void collect(Time now) noexcept;

  /// In lock-step: everything has come that the SYNCs sent so far bring about: the due TPDOs of every started
  /// node, the answers to SDO requests sent before the last SYNC, the boot-up after an NMT reset. What fails
  /// to come several times over is not waited for any more; judging that is `read`'s business.
  [[nodiscard]] bool settled() const noexcept;

  /// Takes in everything received, judges ages and states. Returns false once a fault is latched; from then
  /// on the drives hold their last set-points and `write` is without effect until `clear_fault`.
  bool read(Time now) noexcept;

  /// Stores set-points, in the order of `joint_names`; sent by the next `sync`.
  /// Values outside position limits are clamped, steps faster than the velocity limit shortened: the
  /// set-point then moves on in the following cycles. A value that is not finite, or a wrong number of
  /// commands, is a fault and leaves the set-points as they were.
  void write(const std::vector<JointCommand>& commands) noexcept;

  /// Hand drives: target in 0 (open) .. 1 (closed) of the motor's travel, torque limit in 0..1 of rated.
  void write_hand(int hand, double closure, double torque_limit) noexcept;

  /// Asks a sensor to take its present load as zero (6139h), in the background of the following cycles.
  void tare(int sensor) noexcept;
  [[nodiscard]] TareState tare_state(int sensor) const noexcept;

  /// Sends SYNC on every bus, then the set-points as RPDOs; the devices take them at the next SYNC.
  void sync(Time now) noexcept;

  /// Quick stop on every drive and NMT stop on every bus.
  void stop() noexcept;

  [[nodiscard]] const std::vector<std::string>& joint_names() const;  ///< body joints, table order
  [[nodiscard]] const std::vector<JointState>& joints() const;
  [[nodiscard]] const std::vector<std::string>& hand_names() const;
  [[nodiscard]] const std::vector<JointState>& hands() const;
  [[nodiscard]] const std::vector<std::string>& sensor_names() const;
  [[nodiscard]] const std::vector<ForceTorqueState>& sensors() const;
  [[nodiscard]] const std::vector<std::string>& imu_names() const;
  [[nodiscard]] const std::vector<InertialState>& imus() const;  ///< empty on a robot without

  /// The latched fault. Words are made when it is first asked for, outside the cycle.
  [[nodiscard]] const std::optional<Fault>& fault() const;
  /// Forgets the latched fault and the events behind it; a cause that persists is found again by the next
  /// `read`. A node that booted up, or a drive that left operation enabled, comes back by `recover` or `boot`
  /// only.
  void clear_fault();

  [[nodiscard]] Counters counters() const noexcept;
  [[nodiscard]] std::vector<NodeStatus> nodes() const;  ///< table order
  [[nodiscard]] std::vector<BusStatus> buses() const;   ///< table order
  /// What is not well but no fault, one sentence each: controllers with raised error counters, drives with
  /// their warning bit set.
  [[nodiscard]] std::vector<std::string> warnings() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace walkman::robot
