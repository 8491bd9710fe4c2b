#include "emulator/faults/fault_injector.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

#include "emulator/nodes/cia301/canopen_slave.h"

namespace walkman::faults {
namespace {

constexpr std::uint16_t kContinuousOverCurrent = 0x2310;  // CiA 402
constexpr double kJammed = 1e6;                           // N·m, more than any motor gives

Time time_of(double seconds) { return Time(static_cast<std::int64_t>(seconds * 1e9)); }

}  // namespace

FaultInjector::FaultInjector(std::vector<bus::CanBus*> buses, std::vector<Breakable> devices,
                             MultiSense& camera)
    : buses_(std::move(buses)), devices_(std::move(devices)), camera_(camera) {}

void FaultInjector::add(const Injection& injection, Time now) {
  std::vector<KnownTarget> known;
  for (const bus::CanBus* bus : buses_) known.push_back({bus->name(), true, false, false});
  for (const Breakable& one : devices_)
    known.push_back({one.name, false, one.device->is_drive(), one.device->is_force_torque()});
  require_target(injection, known);
  for (const Entry& entry : entries_)
    if (entry.state.injection.name == injection.name)
      throw std::runtime_error(fmt::format("there is a fault \"{}\" already", injection.name));
  Entry entry;
  entry.state.injection = injection;
  entry.effect = make(injection);
  if (!injection.phase) entry.state.begins = std::max(now, time_of(injection.at));
  entries_.push_back(std::move(entry));
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
    if (state.stage == Stage::kWaiting && now >= state.begins) {
      state.stage = Stage::kActive;
      if (++state.times == 1) state.first = now;
      state.ends = injection.lasts ? state.begins + time_of(*injection.lasts) : Time::max();
      begin(entry);
    }
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
  if (entry.effect.once) entry.effect.once();
  put_together(entry.effect);
}

void FaultInjector::end(Entry& entry) {
  if (entry.effect.frames) {
    faults_of(entry.effect.bus).remove(*entry.effect.frames);
    entry.effect.frames->finish();
  }
  entry.state.stage = InjectionState::Stage::kOver;
  put_together(entry.effect);
}

void FaultInjector::put_together(const Effect& changed) {
  plant::ActuatorFault actuator;
  SensorFaultEvent sensor;
  CameraFault camera;
  bool sensor_broken = false;
  for (const Entry& entry : entries_) {
    const Effect& effect = entry.effect;
    if (entry.state.stage != InjectionState::Stage::kActive) continue;
    if (effect.camera) effect.camera(camera);
    if (effect.device != changed.device) continue;
    if (effect.actuator) effect.actuator(actuator);
    if (effect.sensor) {
      effect.sensor(sensor);
      sensor_broken = true;
    }
  }
  if (changed.camera) camera_.set_fault(camera);
  if (changed.actuator) changed.device->set_actuator_fault(actuator);
  if (!changed.sensor) return;
  if (sensor_broken) {
    changed.device->set_sensor_fault(sensor);
  } else {
    changed.device->mend();
  }
}

BusFaults& FaultInjector::faults_of(std::size_t bus) {
  return bus_faults_.try_emplace(bus, *buses_[bus]).first->second;
}

const Breakable& FaultInjector::device_of(const Injection& injection) const {
  return *std::find_if(devices_.begin(), devices_.end(),
                       [&](const Breakable& one) { return one.name == injection.target; });
}

FaultInjector::Effect FaultInjector::make(const Injection& injection) {
  if (injection.kind->target == Target::kCamera) return make_on_camera(injection);
  Effect effect;
  if (injection.kind->target == Target::kFrames) {
    for (std::size_t i = 0; i < buses_.size(); ++i) {
      if (buses_[i]->name() != injection.target) continue;
      effect.bus = i;
      effect.frames = faults_of(i).make(injection, 0, nullptr);
      return effect;
    }
  }
  return make_on_device(injection);
}

FaultInjector::Effect FaultInjector::make_on_device(const Injection& injection) {
  const Breakable& target = device_of(injection);
  Effect effect;
  effect.device = target.device;
  effect.bus = target.bus;
  nodes::CanopenSlave& node = target.device->node();
  effect.frames = faults_of(target.bus).make(injection, target.node_id, &node);
  if (effect.frames) return effect;

  const std::string_view name = injection.kind->name;
  const auto value = [&](std::string_view parameter) { return injection.value(parameter); };
  const auto on_encoder = [&](auto change) {
    const bool link = value("side") != 0;
    effect.actuator = [link, change](plant::ActuatorFault& fault) {
      change(link ? fault.link : fault.motor);
    };
  };
  if (name == "silent-reboot") effect.once = [&node] { node.restart(); };
  if (name == "nmt-preop-drop") effect.once = [&node] { node.leave_operational(); };
  if (name == "overcurrent-trip")
    effect.once = [device = target.device] {
      device->trip(kContinuousOverCurrent, nodes::error_register::kCurrent);
    };
  if (name == "encoder-offset")
    on_encoder(
        [offset = value("offset")](plant::ActuatorFault::Encoder& encoder) { encoder.offset += offset; });
  if (name == "encoder-stuck")
    on_encoder([](plant::ActuatorFault::Encoder& encoder) { encoder.stuck = true; });
  if (name == "temperature-high")
    effect.actuator = [rise = value("rise")](plant::ActuatorFault& fault) { fault.winding_rise += rise; };
  if (name == "torque-loss")
    effect.actuator = [share = value("share")](plant::ActuatorFault& fault) { fault.torque_share *= share; };
  if (name == "joint-locked") effect.actuator = [](plant::ActuatorFault& fault) { fault.drag = kJammed; };
  if (name == "brake-drag")
    effect.actuator = [torque = value("torque")](plant::ActuatorFault& fault) { fault.drag += torque; };
  if (name == "undervoltage")
    effect.actuator = [volts = value("voltage")](plant::ActuatorFault& fault) {
      fault.supply_voltage = volts;
    };
  if (name == "ft-bias-drift")
    effect.sensor = [force = value("force"), torque = value("torque")](SensorFaultEvent& fault) {
      fault.drift.head<3>().array() += force;
      fault.drift.tail<3>().array() += torque;
    };
  if (name == "ft-sign")
    effect.sensor = [axis = static_cast<Eigen::Index>(value("axis"))](SensorFaultEvent& fault) {
      fault.matrix.row(axis) *= -1;
    };
  if (name == "ft-gain")
    effect.sensor = [gain = value("gain")](SensorFaultEvent& fault) { fault.matrix *= gain; };
  return effect;
}

FaultInjector::Effect FaultInjector::make_on_camera(const Injection& injection) const {
  Effect effect;
  const std::string_view name = injection.kind->name;
  const auto value = [&](std::string_view parameter) { return injection.value(parameter); };
  if (name == "cloud-missing") effect.camera = [](CameraFault& fault) { fault.blind = true; };
  if (name == "cloud-dropout")
    effect.camera = [share = value("share"), seed = injection.seed](CameraFault& fault) {
      fault.dropout = share;
      fault.seed = seed;
    };
  if (name == "extrinsic-error")
    effect.camera = [shift = value("shift"), turn = value("turn")](CameraFault& fault) {
      fault.X_CF =
          fault.X_CF * Eigen::Translation3d(shift, 0, 0) * Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ());
    };
  return effect;
}

}  // namespace walkman::faults
