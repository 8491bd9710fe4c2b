#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "emulator/camera/multisense.h"
#include "emulator/faults/breakable_device.h"
#include "emulator/faults/fault_plan.h"
#include "emulator/faults/frame_faults.h"

namespace walkman::faults {

/// A device that can be broken.
struct Breakable {
  std::string name;
  std::uint8_t node_id = 0;
  std::size_t bus = 0;  ///< its number
  BreakableDevice* device = nullptr;
};

/// Breaks what is emulated, on purpose: the only one that reaches into buses, devices and camera for that.
/// Each fault has a random stream of its own, so one more changes no other.
class FaultInjector {
 public:
  /// All must outlive it.
  FaultInjector(std::vector<bus::CanBus*> buses, std::vector<Breakable> devices, MultiSense& camera);

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

 private:
  /// What an injection does; what it does not need is empty.
  struct Effect {
    BreakableDevice* device = nullptr;
    std::unique_ptr<FrameFault> frames;
    std::function<void()> once;  // when it begins
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
  [[nodiscard]] Effect make_on_camera(const Injection& injection) const;
  [[nodiscard]] const Breakable& device_of(const Injection& injection) const;
  [[nodiscard]] BusFaults& faults_of(std::size_t bus);
  void begin(Entry& entry);
  void end(Entry& entry);
  /// Gives device and camera what all active entries together make of them.
  void put_together(const Effect& changed);

  std::vector<bus::CanBus*> buses_;
  std::vector<Breakable> devices_;
  MultiSense& camera_;
  std::map<std::size_t, BusFaults> bus_faults_;  // of buses that have had one
  std::vector<Entry> entries_;
  std::map<std::string, int> phases_;  // how often each has begun
};

}  // namespace walkman::faults
