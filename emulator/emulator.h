#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "drivers/can/interface.h"
#include "emulator/bus/can_bus.h"
#include "emulator/camera/multisense.h"
#include "emulator/faults/fault_plan.h"
#include "emulator/nodes/measuring/force_torque_kind.h"
#include "emulator/plant/plant.h"
#include "emulator/scene/scene.h"
#include "emulator/scene/true_robot.h"
#include "urdf/reader/device_table.h"

namespace walkman {

struct EmulatorOptions {
  std::filesystem::path actuators;  ///< folder of actuator classes, a YAML file each
  std::filesystem::path sensors;    ///< folder of force/torque sensor kinds; empty: beside `actuators`
  SensorErrors sensor_errors = SensorErrors::kAll;  ///< of the force/torque sensors
  RobotErrors robot_errors;      ///< how drives, sensors and gravity differ from what the files say
  std::filesystem::path camera;  ///< YAML of its parameters; empty: beside `actuators`
  std::uint64_t seed = 1;        ///< of the sensors' noise
  bool bus_timing = true;        ///< false: frames take no time on the buses
  std::set<std::string> absent;  ///< devices whose nodes are somebody else's; their brakes stay on
};

/// The robot that is not there: plant, drives, sensors and buses, behind CAN interfaces and a camera.
///
/// Lock-step: time moves only in `advance`, in physics steps; within each, the buses carry what is due, every
/// drive closes its loops, the plant moves, and the sensors' nodes take their samples.
class Emulator {
 public:
  static constexpr Time kPhysicsStep = std::chrono::milliseconds(1);

  /// `robot`, as it truly is, must outlive the emulator. Throws std::runtime_error when scene, table and
  /// model do not fit together.
  Emulator(const RobotModel& robot, const DeviceTable& devices, const Scene& scene,
           const EmulatorOptions& options);
  ~Emulator();
  Emulator(const Emulator&) = delete;
  Emulator& operator=(const Emulator&) = delete;

  /// Emulates up to `until`, a whole number of physics steps from zero.
  void advance(Time until);
  /// Breaks something, now or when its time comes. Throws std::runtime_error when there is no such target, or
  /// it cannot have the fault.
  void inject(const faults::Injection& injection);
  /// Ends a fault and forgets it; false when there is none of that name.
  bool clear_fault(const std::string& name);
  [[nodiscard]] std::vector<faults::InjectionState> injections() const;
  /// For how long a fault keeps the control program from being run, from now on: to be asked once a cycle by
  /// whoever runs it in this process.
  [[nodiscard]] Time take_stall();
  /// An onlooker sees the robot begin a phase of its task; a scene's events may wait for it.
  void begin_phase(std::string_view phase);
  [[nodiscard]] Time now() const;

  /// Lets the buses alone go on to `until`, within the physics step under way: what a node answers does not
  /// have to wait for the plant's next millisecond. Later times stop at the end of that step.
  void carry(Time until) noexcept;
  /// How far the buses are; `now` to one physics step after it.
  [[nodiscard]] Time buses_now() const noexcept;

  /// The computer's end of each bus, in the order of the device table.
  [[nodiscard]] std::vector<can::Interface*> interfaces();
  [[nodiscard]] MultiSense& camera();
  [[nodiscard]] const MultiSense& camera() const;

  /// Nodes that are emulated on each bus, in the same order.
  [[nodiscard]] const std::vector<std::size_t>& node_counts() const;

  /// The buses themselves, for logs and for losing frames on purpose.
  [[nodiscard]] std::vector<bus::CanBus*> buses();

  /// Ground truth: for judging, never for the pipeline.
  [[nodiscard]] const plant::Plant& plant() const;
  [[nodiscard]] const RobotModel& robot() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace walkman
