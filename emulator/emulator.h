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
  std::filesystem::path actuators;  ///< folder of actuator classes, one YAML file each
  std::filesystem::path sensors;    ///< folder of force/torque sensor kinds; if empty, found from `actuators`
  SensorErrors sensor_errors = SensorErrors::kAll;  ///< errors of the force/torque sensors
  RobotErrors robot_errors;      ///< how drives, sensors and gravity differ from their files
  std::filesystem::path camera;  ///< YAML file of the camera parameters; if empty, found from `actuators`
  std::uint64_t seed = 1;        ///< seed of the sensor noise
  bool bus_timing = true;        ///< false: frames take no time on the buses
  std::set<std::string> absent;  ///< devices whose nodes are not emulated here; their brakes stay engaged
};

/// The emulated robot: plant, drives, sensors and buses, behind CAN interfaces and a camera.
///
/// Lock-step: time advances only in `advance`, in physics steps; in each step the buses carry the frames that
/// are due, every drive runs its control loops, the plant moves, and the sensor nodes take their samples.
class Emulator {
 public:
  static constexpr Time kPhysicsStep = std::chrono::milliseconds(1);

  /// `robot`: the true robot, which must outlive the emulator. Throws std::runtime_error if scene, table and
  /// model are inconsistent.
  Emulator(const RobotModel& robot, const DeviceTable& devices, const Scene& scene,
           const EmulatorOptions& options);
  ~Emulator();
  Emulator(const Emulator&) = delete;
  Emulator& operator=(const Emulator&) = delete;

  /// Advances the emulation to `until`, a whole number of physics steps from zero.
  void advance(Time until);
  /// Injects a fault, now or when its time comes, in place of one of its name that is over. Throws
  /// std::runtime_error if the target does not exist or cannot have the fault, or if one of its name is not
  /// over.
  void inject(const faults::Injection& injection);
  /// Ends a fault and removes it; returns false if there is none of that name.
  bool clear_fault(const std::string& name);
  [[nodiscard]] std::vector<faults::InjectionState> injections() const;
  /// Returns for how long, from now on, a fault keeps the control program from running. To be called once a
  /// cycle by the code that runs that program in this process.
  [[nodiscard]] Time take_stall();
  /// Notes that an observer sees the robot begin a phase of its task; a scene's events may wait for it.
  void begin_phase(std::string_view phase);
  [[nodiscard]] Time now() const;

  /// Advances only the buses, to `until` within the current physics step, so that a node's answer need not
  /// wait for the plant's next millisecond. A later `until` is limited to the end of that step.
  void carry(Time until) noexcept;
  /// Time that the buses have reached: from `now` to one physics step after it.
  [[nodiscard]] Time buses_now() const noexcept;

  /// The computer's interface to each bus, in the order of the device table.
  [[nodiscard]] std::vector<can::Interface*> interfaces();
  [[nodiscard]] MultiSense& camera();
  [[nodiscard]] const MultiSense& camera() const;

  /// Number of nodes emulated on each bus, in the same order.
  [[nodiscard]] const std::vector<std::size_t>& node_counts() const;

  /// The buses themselves, for logging and for losing frames on purpose.
  [[nodiscard]] std::vector<bus::CanBus*> buses();

  /// Ground truth, for evaluation; the pipeline must not use it.
  [[nodiscard]] const plant::Plant& plant() const;
  [[nodiscard]] const RobotModel& robot() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace walkman
