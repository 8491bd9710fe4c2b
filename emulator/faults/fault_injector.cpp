#include "emulator/faults/fault_injector.h"

#include <algorithm>
#include <array>
#include <stdexcept>

#include <fmt/format.h>

#include "emulator/nodes/cia301/canopen_slave.h"

namespace walkman::faults {
namespace {

constexpr std::uint16_t kContinuousOverCurrent = 0x2310;  // CiA 402
constexpr double kJammed = 1e6;                           // N·m, more than any motor gives

Time time_of(double seconds) { return Time(static_cast<std::int64_t>(seconds * 1e9)); }

/// A second device with the same node-ID, in its factory state: it boots, and answers requests to that ID.
class Twin final : public nodes::CanopenSlave {
 public:
  explicit Twin(std::uint8_t node_id) : CanopenSlave({node_id, 0, "twin", 1, 0xFFFF}) {
    configure_pdos({}, {});
  }
};

/// If several of these are there at once, the first one counts: an interface that is down carries nothing,
/// whoever sends, and a program that is gone meets no full queue.
constexpr std::array kHostSides = {bus::HostSide::kDown, bus::HostSide::kDeserted, bus::HostSide::kFull};

nodes::ReadingFault::Parameters reading_parameters(const Injection& injection) {
  nodes::ReadingFault::Parameters out;
  out.seed = injection.stream_seed();
  const std::string_view name = injection.kind->name;
  const auto axis = [&](std::string_view parameter) {
    return static_cast<Eigen::Index>(injection.value(parameter));
  };
  const auto set_both = [&](nodes::Vector6& channels) {
    channels.head<3>().setConstant(injection.value("force"));
    channels.tail<3>().setConstant(injection.value("torque"));
  };
  if (name == "ft-bias-drift") set_both(out.drift);
  if (name == "ft-noise") set_both(out.noise);
  if (name == "ft-saturation") set_both(out.end);
  if (name == "ft-sign") out.matrix.row(axis("axis")) *= -1;
  if (name == "ft-swap") out.matrix.row(axis("axis")).swap(out.matrix.row(axis("other")));
  if (name == "ft-gain") out.matrix *= injection.value("gain");
  if (name == "ft-stuck") {
    out.forces_stuck = axis("part") != 1;
    out.torques_stuck = axis("part") != 0;
  }
  return out;
}

}  // namespace

void FaultInjector::add(const Injection& injection, Time now) {
  require_target(injection, world_.known);
  const auto same = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) {
    return entry.state.injection.name == injection.name;
  });
  if (same != entries_.end() && same->state.stage != InjectionState::Stage::kOver)
    throw std::runtime_error(fmt::format("a fault \"{}\" already exists", injection.name));
  Entry entry;
  entry.state.injection = injection;
  entry.effect = make(injection);
  if (!injection.phase && !injection.frame && !injection.condition)
    entry.state.begins = std::max(now, time_of(injection.at));
  if (same != entries_.end()) entries_.erase(same);
  entries_.push_back(std::move(entry));
  if (!injection.frame) return;
  const auto bus = std::find_if(world_.buses.begin(), world_.buses.end(),
                                [&](const bus::CanBus* one) { return one->name() == injection.frame->bus; });
  faults_of(static_cast<std::size_t>(bus - world_.buses.begin()))
      .await(injection.frame->id, injection.frame->nth, [this, name = injection.name](Time at) {
        for (Entry& one : entries_)
          if (one.state.injection.name == name) start(one, at);
      });
}

bool FaultInjector::holds(const ConditionBegin& condition) const {
  double value = 0;
  int sensors = 0;
  for (const KnownTarget& one : world_.known) {
    if (one.name == condition.device && one.kind == Target::kDrive)
      value = world_.plant.joint_position(world_.robot.joint_index(one.name));
    if (one.name == condition.device && one.kind == Target::kForceTorque)
      value = world_.plant.F_So_S(sensors).force.norm();
    sensors += one.kind == Target::kForceTorque ? 1 : 0;
  }
  return condition.above ? value > condition.value : value < condition.value;
}

void FaultInjector::start(Entry& entry, Time now) {
  InjectionState& state = entry.state;
  state.stage = InjectionState::Stage::kActive;
  state.begins = std::min(state.begins, now);
  if (++state.times == 1) state.first = now;
  const auto& lasts = state.injection.lasts;
  const bool momentary = static_cast<bool>(entry.effect.once);
  state.ends = lasts ? state.begins + time_of(*lasts) : momentary ? now : Time::max();
  begin(entry);
}

bool FaultInjector::clear(const std::string& name) {
  const auto found = std::find_if(entries_.begin(), entries_.end(),
                                  [&](const Entry& entry) { return entry.state.injection.name == name; });
  if (found == entries_.end()) return false;
  if (found->state.stage == InjectionState::Stage::kActive) end(*found);
  entries_.erase(found);
  return true;
}

void FaultInjector::begin_phase(std::string_view phase, Time now) {
  const int times = ++phases_[std::string(phase)];
  for (Entry& entry : entries_) {
    const auto& wanted = entry.state.injection.phase;
    if (wanted && wanted->phase == phase && wanted->occurrence == times)
      entry.state.begins = now + time_of(wanted->after);
  }
}

void FaultInjector::step(Time now) {
  using Stage = InjectionState::Stage;
  for (Entry& entry : entries_) {
    InjectionState& state = entry.state;
    const Injection& injection = state.injection;
    if (state.stage == Stage::kActive && now >= state.ends) {
      end(entry);
      state.stage = injection.every ? Stage::kWaiting : Stage::kOver;
      if (injection.every) state.begins += time_of(*injection.every);
    }
    if (state.stage == Stage::kActive && entry.effect.during) entry.effect.during();
    const bool comes = injection.condition && state.times == 0 && holds(*injection.condition);
    if (state.stage == Stage::kWaiting && (comes || now >= state.begins)) start(entry, now);
  }
  for (auto& [bus, faults] : bus_faults_) faults.step(now);
}

std::vector<InjectionState> FaultInjector::states() const {
  std::vector<InjectionState> out;
  for (const Entry& entry : entries_) {
    out.push_back(entry.state);
    if (entry.effect.frames) out.back().touched = entry.effect.frames->touched();
  }
  return out;
}

void FaultInjector::begin(Entry& entry) {
  if (entry.effect.frames) {
    entry.effect.frames->start();
    faults_of(entry.effect.bus).add(*entry.effect.frames);
  }
  if (entry.effect.readings) {
    entry.effect.readings->start();
    for (BreakableDevice* device : entry.effect.devices)
      device->force_torque()->faults().add(*entry.effect.readings);
  }
  if (entry.effect.once) entry.effect.once();
  if (entry.effect.during) entry.effect.during();
  if (entry.effect.switched) entry.effect.switched(true);
  put_together(entry.effect);
}

void FaultInjector::end(Entry& entry) {
  if (entry.effect.frames) {
    faults_of(entry.effect.bus).remove(*entry.effect.frames);
    entry.effect.frames->finish();
  }
  if (entry.effect.readings)
    for (BreakableDevice* device : entry.effect.devices)
      device->force_torque()->faults().remove(*entry.effect.readings);
  if (entry.effect.switched) entry.effect.switched(false);
  entry.state.stage = InjectionState::Stage::kOver;
  put_together(entry.effect);
}

void FaultInjector::put_together(const Effect& changed) {
  CameraFault camera;
  plant::ObjectFault object;
  for (const Entry& entry : entries_) {
    const Effect& effect = entry.effect;
    if (entry.state.stage != InjectionState::Stage::kActive) continue;
    if (effect.camera) effect.camera(camera);
    if (effect.on_object && effect.object == changed.object) effect.on_object(object);
  }
  if (changed.camera) world_.camera.set_fault(camera);
  if (changed.on_object) world_.plant.set_object_fault(changed.object, object);
  for (BreakableDevice* device : changed.devices) put_together(*device, changed);
  for (bus::CanBus* bus : changed.host_buses) bus->computer_port().set_host_side(host_side_of(bus));
}

bus::HostSide FaultInjector::host_side_of(const bus::CanBus* bus) const {
  for (const bus::HostSide side : kHostSides)
    for (const Entry& entry : entries_) {
      const auto& buses = entry.effect.host_buses;
      if (entry.state.stage == InjectionState::Stage::kActive && entry.effect.host == side &&
          std::find(buses.begin(), buses.end(), bus) != buses.end())
        return side;
    }
  return bus::HostSide::kSound;
}

void FaultInjector::put_together(BreakableDevice& device, const Effect& changed) {
  plant::ActuatorFault actuator;
  double ppm = 0;
  for (const Entry& entry : entries_) {
    const Effect& effect = entry.effect;
    const auto& whom = effect.devices;
    if (entry.state.stage != InjectionState::Stage::kActive ||
        std::find(whom.begin(), whom.end(), &device) == whom.end())
      continue;
    if (effect.actuator) effect.actuator(actuator);
    // Rates multiply; in this form one fault alone gives exactly its own.
    if (effect.ppm) ppm += *effect.ppm + ppm * *effect.ppm * 1e-6;
  }
  if (changed.actuator) device.set_actuator_fault(actuator);
  if (changed.ppm) device.node().detune(ppm);
}

BusFaults& FaultInjector::faults_of(std::size_t bus) {
  return bus_faults_.try_emplace(bus, *world_.buses[bus]).first->second;
}

const Breakable& FaultInjector::device_of(const Injection& injection) const {
  return *std::find_if(world_.devices.begin(), world_.devices.end(),
                       [&](const Breakable& one) { return one.name == injection.target; });
}

std::size_t FaultInjector::bus_of(const Injection& injection) const {
  const auto found = std::find_if(world_.buses.begin(), world_.buses.end(),
                                  [&](const bus::CanBus* bus) { return bus->name() == injection.target; });
  return static_cast<std::size_t>(found - world_.buses.begin());
}

FaultInjector::Effect FaultInjector::make(const Injection& injection) {
  switch (injection.kind->target) {
    case Target::kCamera:
      return make_on_camera(injection);
    case Target::kObject:
    case Target::kWeight:
    case Target::kLink:
      return make_on_world(injection);
    case Target::kHost:
      return make_on_computer(injection);
    case Target::kFrames:
    case Target::kDrives:
    case Target::kBus:
      break;
    case Target::kDevice:
    case Target::kDrive:
    case Target::kForceTorque:
      return make_on_device(injection);
  }
  const std::size_t bus = bus_of(injection);
  if (bus == world_.buses.size()) return make_on_device(injection);
  if (injection.kind->target == Target::kDrives) return make_on_drives(injection, bus);
  Effect effect;
  effect.bus = bus;
  effect.frames = faults_of(bus).make(injection, 0, nullptr);
  return effect.frames ? std::move(effect) : make_on_computer(injection);
}

FaultInjector::Effect FaultInjector::make_on_device(const Injection& injection) {
  const Breakable& target = device_of(injection);
  nodes::CanopenSlave& node = target.device->node();
  Effect effect;
  if (injection.kind->target == Target::kDrive || injection.kind->target == Target::kDrives)
    effect = make_on_drive(injection);
  if (injection.kind->target == Target::kForceTorque)
    effect.readings = std::make_unique<nodes::ReadingFault>(
        target.device->force_torque()->make_fault(reading_parameters(injection)));
  effect.devices = {target.device};
  effect.bus = target.bus;
  effect.frames = faults_of(target.bus).make(injection, target.node_id, &node);
  const std::string_view name = injection.kind->name;
  if (name == "silent-reboot") effect.once = [&node] { node.restart(); };
  if (name == "sdo-abort")
    effect.switched = [&node, index = static_cast<std::uint16_t>(injection.value("index")),
                       code = static_cast<canopen::SdoAbort>(injection.value("code"))](bool on) {
      on ? node.sdo_server().refuse(index, code) : node.sdo_server().stop_refusing(index);
    };
  if (name == "clock-drift") effect.ppm = injection.value("ppm");
  if (name == "nmt-preop-drop") effect.once = [&node] { node.leave_operational(); };
  if (name == "overcurrent-trip")
    effect.once = [device = target.device] {
      device->trip(kContinuousOverCurrent, nodes::error_register::kCurrent);
    };
  if (name == "duplicate-node") {
    // Created now, and on the bus from the fault's beginning: attaching it switches it on.
    nodes::CanopenSlave& twin = *twins_.emplace_back(std::make_unique<Twin>(target.node_id));
    bus::CanBus& bus = *world_.buses[target.bus];
    effect.switched = [&twin, &bus, attached = false](bool on) mutable {
      if (!on) return bus.cut(twin);
      if (!std::exchange(attached, true)) return bus.attach(twin);
      bus.reconnect(twin);
      twin.restart();
    };
  }
  return effect;
}

FaultInjector::Effect FaultInjector::make_on_drives(const Injection& injection, std::size_t bus) {
  Effect effect = make_on_drive(injection);
  for (const Breakable& one : world_.devices) {
    const bool drive = std::any_of(world_.known.begin(), world_.known.end(), [&](const KnownTarget& known) {
      return known.name == one.name && known.kind == Target::kDrive;
    });
    if (one.bus == bus && drive) effect.devices.push_back(one.device);
  }
  return effect;
}

FaultInjector::Effect FaultInjector::make_on_drive(const Injection& injection) {
  using plant::ActuatorFault;
  Effect effect;
  const std::string_view name = injection.kind->name;
  const auto value = [&](std::string_view parameter) { return injection.value(parameter); };
  const auto on_encoder = [&](auto change) {
    const bool link = value("side") != 0;
    effect.actuator = [link, change](ActuatorFault& fault) { change(link ? fault.link : fault.motor); };
  };
  if (name == "encoder-offset")
    on_encoder([offset = value("offset")](ActuatorFault::Encoder& encoder) { encoder.offset += offset; });
  if (name == "encoder-stuck") on_encoder([](ActuatorFault::Encoder& encoder) { encoder.stuck = true; });
  if (name == "torque-dropout") effect.actuator = [](ActuatorFault& fault) { fault.torque_lost = true; };
  if (name == "temperature-high")
    effect.actuator = [rise = value("rise"), rate = value("rate")](ActuatorFault& fault) {
      fault.winding_rise += rise;
      fault.winding_rate = std::min(fault.winding_rate, rate);
    };
  if (name == "torque-loss")
    effect.actuator = [share = value("share")](ActuatorFault& fault) { fault.torque_share *= share; };
  if (name == "joint-locked") effect.actuator = [](ActuatorFault& fault) { fault.drag = kJammed; };
  if (name == "brake-drag")
    effect.actuator = [torque = value("torque")](ActuatorFault& fault) { fault.drag += torque; };
  if (name == "runaway")
    effect.actuator = [torque = value("torque")](ActuatorFault& fault) {
      fault.torque_share = 0;
      fault.own_torque += torque;
    };
  if (name == "backlash")
    effect.actuator = [play = value("play")](ActuatorFault& fault) { fault.play += play; };
  if (name == "compliance-change")
    effect.actuator = [share = value("stiffness")](ActuatorFault& fault) { fault.stiffness *= share; };
  if (name == "undervoltage")
    effect.actuator = [volts = value("voltage")](ActuatorFault& fault) { fault.supply_voltage = volts; };
  return effect;
}

FaultInjector::Effect FaultInjector::make_on_camera(const Injection& injection) {
  Effect effect;
  const std::string_view name = injection.kind->name;
  const auto value = [&](std::string_view parameter) { return injection.value(parameter); };
  const auto moved = [&](const Eigen::Isometry3d& X) {
    effect.camera = [X](CameraFault& fault) { fault.X_CF = fault.X_CF * X; };
  };
  const auto turned = [](double angle, const Eigen::Vector3d& axis) {
    return Eigen::Isometry3d(Eigen::AngleAxisd(angle, axis));
  };
  if (name == "cloud-missing") effect.camera = [](CameraFault& fault) { fault.blind = true; };
  if (name == "cloud-dropout")
    effect.camera = [share = value("share"), seed = injection.stream_seed()](CameraFault& fault) {
      fault.dropout = share;
      fault.seed = seed;
    };
  if (name == "cloud-stale") effect.camera = [](CameraFault& fault) { fault.stale = true; };
  if (name == "cloud-occlusion")
    effect.camera = [from = value("from"), to = value("to")](CameraFault& fault) {
      fault.hidden = {from, to};
    };
  if (name == "extrinsic-error")
    moved(Eigen::Translation3d(value("shift"), 0, 0) * turned(value("turn"), Eigen::Vector3d::UnitZ()));
  if (name == "plane-misfit") moved(turned(value("tilt"), Eigen::Vector3d::UnitX()));
  if (name == "phantom-points")
    effect.camera = [size = static_cast<int>(value("size")),
                     distance = value("distance")](CameraFault& fault) {
      fault.phantom = {size, distance};
    };
  return effect;
}

FaultInjector::Effect FaultInjector::make_on_world(const Injection& injection) {
  Effect effect;
  const std::string_view name = injection.kind->name;
  const auto value = [&](std::string_view parameter) { return injection.value(parameter); };
  if (name == "push") {
    effect.during = [this, link = world_.robot.link_index(injection.target),
                     force = Eigen::Vector3d(value("x"), value("y"), value("z"))] {
      world_.plant.push(link, force);
    };
    return effect;
  }
  if (name == "weight-removed") {
    effect.object = world_.weights.at(injection.target);
    effect.on_object = [weight = injection.target](plant::ObjectFault& fault) {
      fault.lost_weights.push_back(weight);
    };
    return effect;
  }
  const auto object = std::find(world_.objects.begin(), world_.objects.end(), injection.target);
  effect.object = static_cast<int>(object - world_.objects.begin());
  if (name == "slip")
    effect.on_object = [share = value("friction")](plant::ObjectFault& fault) { fault.friction *= share; };
  if (name == "payload")
    effect.on_object = [mass = value("mass")](plant::ObjectFault& fault) { fault.extra_mass += mass; };
  return effect;
}

FaultInjector::Effect FaultInjector::make_on_computer(const Injection& injection) {
  Effect effect;
  const std::string_view name = injection.kind->name;
  if (name == "scheduler-stall") {
    effect.once = [this, stall = time_of(injection.value("stall"))] { stall_ = stall; };
    return effect;
  }
  if (name == "driver-kill") {
    effect.host_buses = world_.buses;
    effect.host = bus::HostSide::kDeserted;
  } else {
    effect.host_buses = {world_.buses[bus_of(injection)]};
    effect.host = name == "interface-down" ? bus::HostSide::kDown : bus::HostSide::kFull;
  }
  return effect;
}

}  // namespace walkman::faults
