#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "emulator/camera/multisense.h"
#include "emulator/faults/breakable_device.h"
#include "emulator/faults/fault_plan.h"
#include "emulator/faults/frame_faults.h"
#include "emulator/nodes/measuring/force_torque_node.h"
#include "emulator/plant/plant.h"

namespace walkman::faults {

/// Everything that can be broken, with its names.
struct BreakableWorld {
  std::vector<bus::CanBus*> buses;
  std::vector<Breakable> devices;
  MultiSense& camera;
  plant::Plant& plant;
  const RobotModel& robot;
  std::vector<std::string> objects;  ///< in the plant's order
  /// Object of each weight.
  std::map<std::string, int> weights;
  std::vector<KnownTarget> known;
};

/// Injects faults into the emulation: the only class that reaches into buses, devices, camera and plant for
/// that purpose. Each fault has its own state and random stream, so adding or ending one changes no other.
class FaultInjector {
 public:
  /// Everything that `world` refers to must outlive the injector.
  explicit FaultInjector(BreakableWorld world) : world_(std::move(world)) {}

  /// Replaces a fault of the same name that is over. Throws std::runtime_error if the target does not exist
  /// or cannot have the fault, or if the fault of that name is not over.
  void add(const Injection& injection, Time now);
  /// Ends and removes an injection; returns false if there is none of that name.
  bool clear(const std::string& name);

  /// Call when an onlooker sees the robot begin a phase of its task.
  void begin_phase(std::string_view phase, Time now);
  /// Call when a physics step begins: begins and ends the injections that are due.
  void step(Time now);

  [[nodiscard]] std::vector<InjectionState> states() const;
  /// Returns for how long the control program is not run from now on, and clears it.
  [[nodiscard]] Time take_stall() noexcept { return std::exchange(stall_, Time{}); }

 private:
  /// Effect of an injection; members that it does not need are empty.
  struct Effect {
    std::vector<BreakableDevice*> devices;
    std::unique_ptr<FrameFault> frames;
    std::function<void()> once;          // when it begins
    std::function<void()> during;        // in every step
    std::function<void(bool)> switched;  // when it begins, and when it ends
    int object = -1;                     // index in the plant
    std::function<void(plant::ObjectFault&)> on_object;
    std::function<void(plant::ActuatorFault&)> actuator;
    std::unique_ptr<nodes::ReadingFault> readings;  // of the devices' sensors
    std::optional<double> ppm;                      // by which the devices' clocks are fast
    std::vector<bus::CanBus*> host_buses;           // on which the computer's side is `host`
    bus::HostSide host = bus::HostSide::kSound;
    std::function<void(CameraFault&)> camera;
    std::size_t bus = 0;  // that the frames are on
  };
  struct Entry {
    InjectionState state;
    Effect effect;
  };

  [[nodiscard]] Effect make(const Injection& injection);
  [[nodiscard]] Effect make_on_device(const Injection& injection);
  [[nodiscard]] static Effect make_on_drive(const Injection& injection);
  /// For all drives of a bus.
  [[nodiscard]] Effect make_on_drives(const Injection& injection, std::size_t bus);
  [[nodiscard]] static Effect make_on_camera(const Injection& injection);
  [[nodiscard]] Effect make_on_world(const Injection& injection);
  [[nodiscard]] Effect make_on_computer(const Injection& injection);
  [[nodiscard]] const Breakable& device_of(const Injection& injection) const;
  /// Index of the target's bus; the number of buses if the target is not a bus.
  [[nodiscard]] std::size_t bus_of(const Injection& injection) const;
  [[nodiscard]] BusFaults& faults_of(std::size_t bus);
  /// Begins an entry that is due.
  void start(Entry& entry, Time now);
  [[nodiscard]] bool holds(const ConditionBegin& condition) const;
  void begin(Entry& entry);
  void end(Entry& entry);
  /// Applies the combined faults of all active entries to devices, object, camera and host.
  void put_together(const Effect& changed);
  void put_together(BreakableDevice& device, const Effect& changed);
  [[nodiscard]] bus::HostSide host_side_of(const bus::CanBus* bus) const;

  BreakableWorld world_;
  std::vector<std::unique_ptr<nodes::CanopenSlave>> twins_;  // duplicates of nodes
  Time stall_{};
  std::map<std::size_t, BusFaults> bus_faults_;  // only of buses that have had a fault
  std::vector<Entry> entries_;
  std::map<std::string, int> phases_;  // how often each has begun
};

}  // namespace walkman::faults
