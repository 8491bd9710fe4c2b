#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "emulator/camera/multisense.h"
#include "emulator/faults/breakable_device.h"
#include "emulator/faults/fault_plan.h"
#include "emulator/faults/frame_faults.h"
#include "emulator/plant/plant.h"

namespace walkman::faults {

/// All that can be broken, and what it is called.
struct BreakableWorld {
  std::vector<bus::CanBus*> buses;
  std::vector<Breakable> devices;
  MultiSense& camera;
  plant::Plant& plant;
  const RobotModel& robot;
  std::vector<std::string> objects;  ///< in the plant's order
  /// Of each weight: its object.
  std::map<std::string, int> weights;
  std::vector<KnownTarget> known;
};

/// Breaks what is emulated, on purpose: the only one that reaches into buses, devices, camera and plant for
/// that. Each fault has a random stream of its own, so one more changes no other.
class FaultInjector {
 public:
  /// All that `world` refers to must outlive it.
  explicit FaultInjector(BreakableWorld world) : world_(std::move(world)) {}

  /// Throws std::runtime_error when there is no such target, or it cannot have the fault, or its name is
  /// taken.
  void add(const Injection& injection, Time now);
  /// Ends an injection and forgets it; false when there is none of that name.
  bool clear(const std::string& name);

  /// An onlooker sees the robot begin a phase of its task.
  void begin_phase(std::string_view phase, Time now);
  /// A physics step begins: what is due begins or ends.
  void step(Time now);

  [[nodiscard]] std::vector<InjectionState> states() const;
  /// For how long the control program is not run from now on; asked once, it is over.
  [[nodiscard]] Time take_stall() noexcept { return std::exchange(stall_, Time{}); }

 private:
  /// What an injection does; what it does not need is empty.
  struct Effect {
    std::vector<BreakableDevice*> devices;
    std::unique_ptr<FrameFault> frames;
    std::function<void()> once;          // when it begins
    std::function<void()> during;        // in every step
    std::function<void(bool)> switched;  // when it begins, and when it ends
    int object = -1;                     // of the plant
    std::function<void(plant::ObjectFault&)> on_object;
    std::function<void(plant::ActuatorFault&)> actuator;
    std::function<void(SensorFaultEvent&)> sensor;
    std::function<void(CameraFault&)> camera;
    std::size_t bus = 0;  // of the frames
  };
  struct Entry {
    InjectionState state;
    Effect effect;
  };

  [[nodiscard]] Effect make(const Injection& injection);
  [[nodiscard]] Effect make_on_device(const Injection& injection);
  [[nodiscard]] static Effect make_on_drive(const Injection& injection);
  /// Of all drives of a bus.
  [[nodiscard]] Effect make_on_drives(const Injection& injection, std::size_t bus);
  [[nodiscard]] static Effect make_on_sensor(const Injection& injection);
  [[nodiscard]] static Effect make_on_camera(const Injection& injection);
  [[nodiscard]] Effect make_on_world(const Injection& injection);
  [[nodiscard]] Effect make_on_computer(const Injection& injection);
  [[nodiscard]] const Breakable& device_of(const Injection& injection) const;
  /// Its number; as many as there are when the target is none.
  [[nodiscard]] std::size_t bus_of(const Injection& injection) const;
  [[nodiscard]] BusFaults& faults_of(std::size_t bus);
  /// It is due: begins.
  void start(Entry& entry, Time now);
  [[nodiscard]] bool holds(const ConditionBegin& condition) const;
  void begin(Entry& entry);
  void end(Entry& entry);
  /// Gives devices, object and camera what all active entries together make of them.
  void put_together(const Effect& changed);
  void put_together(BreakableDevice& device, const Effect& changed);

  BreakableWorld world_;
  std::vector<std::unique_ptr<nodes::CanopenSlave>> twins_;  // of nodes
  Time stall_{};
  std::map<std::size_t, BusFaults> bus_faults_;  // of buses that have had one
  std::vector<Entry> entries_;
  std::map<std::string, int> phases_;  // how often each has begun
};

}  // namespace walkman::faults
