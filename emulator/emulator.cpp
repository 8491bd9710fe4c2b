#include "emulator/emulator.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <variant>

#include <fmt/format.h>

#include "emulator/datasheets/device_files.h"
#include "emulator/emulated_device.h"
#include "emulator/faults/fault_injector.h"
#include "urdf/reader/nearest_name.h"

namespace walkman {
namespace {

constexpr double kSubStep = plant::Plant::kStep / plant::Plant::kSubSteps;

/// FNV-1a hash of a file's bytes; that of no bytes if the file cannot be read.
std::uint32_t hash_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::uint32_t hash = 0x811C9DC5;
  for (std::istreambuf_iterator<char> it(stream), end; it != end; ++it) {
    hash = (hash ^ static_cast<std::uint8_t>(*it)) * 0x01000193;
  }
  return hash;
}

}  // namespace

struct Emulator::Impl {
  Impl(const RobotModel& robot, const DeviceTable& table, const Scene& scene, const EmulatorOptions& options,
       const std::map<std::string, plant::ActuatorParameters>& actuators);

  void step();
  void pass_on(const SensorFaultEvent& fault);
  [[nodiscard]] faults::BreakableWorld breakable_world();
  const RobotModel& model;
  plant::Plant plant;
  MultiSense multisense;
  std::vector<std::unique_ptr<bus::CanBus>> buses;
  std::vector<std::unique_ptr<EmulatedDevice>> devices;  // in the order of the device table
  std::vector<std::string> names;                        // in the same order
  std::vector<std::size_t> node_counts;                  // for each bus
  std::vector<faults::Breakable> breakable;              // in the order of the device table
  std::vector<std::string> objects;                      // names of the scene's objects
  std::map<std::string, int> weights;                    // index of the object each weight is attached to
  std::set<std::string> absent;                          // devices, and buses all of whose devices are
  std::vector<faults::KnownTarget> targets;              // possible targets of faults
  std::optional<faults::FaultInjector> injector;         // exists from the start because it counts the phases
  Time now{};
};

/// Rejects faults of sensors that do not exist, which would go unnoticed.
void require_sensors(const Scene& scene, const DeviceTable& table) {
  std::vector<std::string> known;
  for (const Bus& bus : table.buses)
    for (const Device& device : bus.devices)
      if (device.kind == DeviceKind::kForceTorque) known.push_back(device.name);
  for (const SceneEvent& event : scene.events) {
    const auto* fault = std::get_if<SensorFaultEvent>(&event.what);
    if (fault == nullptr || std::find(known.begin(), known.end(), fault->sensor) != known.end()) continue;
    throw std::runtime_error(
        fmt::format("{}: events sensor_fault.sensor: there is no force/torque sensor \"{}\"{}", event.where,
                    fault->sensor, did_you_mean(fault->sensor, known)));
  }
}

CameraParameters camera_of(const Scene& scene, const EmulatorOptions& options) {
  const CameraParameters parameters = load_camera_parameters(
      options.camera.empty() ? options.actuators / "../../camera/multisense.yaml" : options.camera);
  return scene.camera_noise ? parameters : parameters.noise_free();
}

Emulator::Impl::Impl(const RobotModel& robot, const DeviceTable& table, const Scene& scene,
                     const EmulatorOptions& options,
                     const std::map<std::string, plant::ActuatorParameters>& actuators)
    : model(robot),
      plant(robot, scene, table, actuators, options.robot_errors),
      multisense(robot, scene, robot.link_index(scene.robot.optical_frame), camera_of(scene, options),
                 options.seed) {
  require_sensors(scene, table);
  for (const SceneObject& object : scene.objects) {
    for (const AttachedWeight& weight : object.weights)
      weights.emplace(weight.name, static_cast<int>(objects.size()));
    objects.push_back(object.name);
  }
  targets = faults::known_targets(robot, table, scene);
  for (const Bus& wiring : table.buses) {
    const bool none = std::all_of(wiring.devices.begin(), wiring.devices.end(),
                                  [&](const Device& device) { return options.absent.contains(device.name); });
    if (none) absent.insert(wiring.name);
  }
  absent.insert(options.absent.begin(), options.absent.end());
  std::erase_if(targets, [&](const faults::KnownTarget& target) { return absent.contains(target.name); });
  const DeviceSurroundings surroundings{table, robot, options, actuators, hash_of(scene.robot.urdf), plant};
  for (const Bus& wiring : table.buses) {
    buses.push_back(std::make_unique<bus::CanBus>(
        wiring.name, wiring.interface,
        bus::BusOptions{wiring.bit_rate, wiring.fd, wiring.data_bit_rate, options.bus_timing}));
    node_counts.push_back(0);
    for (const Device& device : wiring.devices) {
      devices.push_back(make_device(surroundings, device, static_cast<std::uint16_t>(buses.size())));
      names.push_back(device.name);
      breakable.push_back({device.name, device.node_id, buses.size() - 1, devices.back().get()});
      nodes::CanopenSlave& node = devices.back()->node();
      if (wiring.fd) node.use_fd();
      buses.back()->attach(node);
      if (options.absent.contains(device.name)) {
        buses.back()->cut(node);
      } else {
        ++node_counts.back();
      }
    }
  }
}

void Emulator::Impl::pass_on(const SensorFaultEvent& fault) {
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i] == fault.sensor) devices[i]->set_sensor_fault(fault);
}

faults::BreakableWorld Emulator::Impl::breakable_world() {
  std::vector<bus::CanBus*> all;
  for (const auto& bus : buses) all.push_back(bus.get());
  return {all, breakable, multisense, plant, model, objects, weights, targets};
}

void Emulator::Impl::step() {
  const Time next = now + kPhysicsStep;
  injector->step(now);
  for (const auto& bus : buses) bus->advance(next);
  // Drives do not affect one another until the plant moves, so each runs its sub-steps while it is cached.
  for (const auto& device : devices)
    for (int sub_step = 0; sub_step < plant::Plant::kSubSteps; ++sub_step) device->control(kSubStep);
  plant.turn_spindle(multisense.spindle_rate());
  plant.step();
  for (const SensorFaultEvent& fault : plant.take_sensor_faults()) pass_on(fault);
  for (const auto& device : devices) device->sample();
  now = next;
  multisense.advance(now, plant);
}

Emulator::Emulator(const RobotModel& robot, const DeviceTable& devices, const Scene& scene,
                   const EmulatorOptions& options)
    : impl_(
          std::make_unique<Impl>(robot, devices, scene, options, plant::load_actuators(options.actuators))) {
  impl_->injector.emplace(impl_->breakable_world());
  datasheets::store_data_sheets(datasheets::wired_buses(devices, buses()));
}

Emulator::~Emulator() = default;

void Emulator::inject(const faults::Injection& injection) {
  if (impl_->absent.contains(injection.target))
    throw std::runtime_error(fmt::format("{}{}{}: {} is not emulated here, expected a target that is",
                                         injection.where, injection.where.empty() ? "" : ": ",
                                         injection.kind->name, injection.target));
  impl_->injector->add(injection, impl_->now);
}

bool Emulator::clear_fault(const std::string& name) { return impl_->injector->clear(name); }

std::vector<faults::InjectionState> Emulator::injections() const { return impl_->injector->states(); }

Time Emulator::take_stall() { return impl_->injector->take_stall(); }

void Emulator::begin_phase(std::string_view phase) {
  impl_->plant.begin_phase(phase);
  impl_->injector->begin_phase(phase, impl_->now);
}

void Emulator::advance(Time until) {
  while (impl_->now + kPhysicsStep <= until) impl_->step();
}

void Emulator::carry(Time until) noexcept {
  const Time end = std::min(until, impl_->now + kPhysicsStep);
  for (const auto& bus : impl_->buses) bus->advance(end);
}

Time Emulator::buses_now() const noexcept {
  return impl_->buses.empty() ? impl_->now : impl_->buses.front()->now();
}

Time Emulator::now() const { return impl_->now; }

std::vector<can::Interface*> Emulator::interfaces() {
  std::vector<can::Interface*> ends;
  for (const auto& bus : impl_->buses) ends.push_back(&bus->computer_port());
  return ends;
}

MultiSense& Emulator::camera() { return impl_->multisense; }

const MultiSense& Emulator::camera() const { return impl_->multisense; }

const std::vector<std::size_t>& Emulator::node_counts() const { return impl_->node_counts; }

std::vector<bus::CanBus*> Emulator::buses() {
  std::vector<bus::CanBus*> all;
  for (const auto& bus : impl_->buses) all.push_back(bus.get());
  return all;
}

const plant::Plant& Emulator::plant() const { return impl_->plant; }

const RobotModel& Emulator::robot() const { return impl_->model; }

}  // namespace walkman
