#include "apps/grasp/grasp_run.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/shared/can_map.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/master_options.h"
#include "apps/shared/stop_signals.h"
#include "drivers/camera/multisense/camera.h"
#include "drivers/camera/multisense/udp_port.h"
#include "drivers/robot/heartbeat_pace.h"
#include "drivers/robot/kernel_cycle.h"

namespace walkman::apps {
namespace {

constexpr Time kStopLimit = std::chrono::milliseconds(100);  // for the last frames of a bus

double seconds(Time t) { return std::chrono::duration<double>(t).count(); }

robot::MasterBuses open_buses(const std::string& can, const DeviceTable& devices) {
  const std::vector<CanAssignment> assignments = parse_can_map(can, devices);
  std::vector<std::string> missing;
  for (std::size_t i = 0; i < devices.buses.size(); ++i) {
    bool found = false;
    for (const CanAssignment& assignment : assignments) found = found || assignment.bus == i;
    if (!found) missing.push_back(devices.buses[i].name);
  }
  if (!missing.empty()) {
    throw std::runtime_error(fmt::format(
        "--can: no interface for {}, expected one for every bus of the robot", fmt::join(missing, ", ")));
  }
  robot::MasterBuses buses;
  for (const CanAssignment& assignment : assignments) {
    buses.push_back(std::make_unique<robot::MasterBus>(open_can(assignment.interface_name, {})));
  }
  return buses;
}

std::unique_ptr<multisense::Camera> open_camera(multisense::DatagramPort& port, const std::string& address,
                                                std::function<Time()> now) {
  try {
    return std::make_unique<multisense::Camera>(port, "the camera at " + address, std::move(now));
  } catch (const std::runtime_error& e) {
    throw EnvironmentError(e.what());
  }
}

/// Forwards the events of the pipeline.
class Watcher : public regrasp::Observer {
 public:
  Watcher(const GraspEvents& events, GraspResult& result, Time began)
      : events_(events), result_(result), began_(began) {}

  void on_phase(std::string_view phase, Time now) override {
    phase_ = phase;
    report(now);
  }
  void on_cycle(Time now, const Wrench&, const Eigen::Isometry3d&) override { report(now); }
  void on_recovery(std::string_view, Time) override { ++result_.recoveries; }
  void on_warning(std::string_view warning, Time) override {
    result_.warnings.emplace_back(warning);
    if (events_.warned) events_.warned(warning);
  }
  void on_weighed(const regrasp::Weighing& weighing) override {
    result_.weighings.push_back(weighing);
    if (events_.weighed) events_.weighed(weighing);
  }

 private:
  void report(Time now) {
    result_.seconds =
        seconds(std::max(Time{}, now - began_));  // the first phase begins before the first cycle
    if (events_.cycle) events_.cycle(phase_, result_.seconds);
  }

  const GraspEvents& events_;
  GraspResult& result_;
  std::string phase_;
  Time began_;
};

std::string what_is_needed(const robot::RobotOptions& options, Pacing pacing) {
  const double cycle_ms = seconds(options.cycle) * 1e3;
  return pacing == Pacing::kLockstep
             ? fmt::format("--lockstep at {:g} Hz needs an emulator with --lockstep --period {:g}",
                           1e3 / cycle_ms, cycle_ms)
             : "--realtime needs a robot, or an emulator without --lockstep on a host that is fast enough";
}

/// Cycles of a lock-step master. One of the first, once a node produces heartbeats, is made to wait: if time
/// stands still between two SYNCs, a node then sends at most the heartbeat that was already under way.
/// Intervals alone do not show it: on a fast host the cycles may take just as long as the time they
/// represent.
class ProvenLockstep final : public robot::Cycle {
 public:
  ProvenLockstep(robot::KernelLockstepCycle& inner, const robot::HeartbeatPace& pace,
                 const robot::RobotOptions& options)
      : inner_(inner), pace_(pace), options_(options) {}

  Time next() override {
    const Time now = inner_.next();
    if (proven_ || pace_.heartbeats() == 0) return now;
    const std::uint64_t before = pace_.heartbeats();
    inner_.hold(pause());
    proven_ = true;
    came_ = pace_.heartbeats() - before;
    require();
    return now;
  }

  /// Throws EnvironmentError if time did not stand still.
  void require() const {
    if (came_ <= 1) return;
    throw EnvironmentError(fmt::format("a node sent {} heartbeats in {:g} ms without a SYNC: {}", came_,
                                       seconds(pause()) * 1e3, what_is_needed(options_, Pacing::kLockstep)));
  }

 private:
  [[nodiscard]] Time pause() const { return options_.heartbeat_producer * 5 / 2; }

  robot::KernelLockstepCycle& inner_;
  const robot::HeartbeatPace& pace_;
  const robot::RobotOptions& options_;
  bool proven_ = false;
  std::uint64_t came_ = 0;
};

/// Reports that the robot's time does not run at the master's pace.
[[noreturn]] void throw_other_pace(Time interval, const robot::RobotOptions& options, Pacing pacing) {
  throw EnvironmentError(fmt::format(
      "heartbeats that are due every {:g} ms arrive every {:g} ms of the master's time: {}",
      seconds(options.heartbeat_producer) * 1e3, seconds(interval) * 1e3, what_is_needed(options, pacing)));
}

}  // namespace

GraspResult run_grasp(const KnownRobot& known, const GraspOptions& options, StopSignals& signals,
                      const GraspEvents& events) {
  const DeviceTable& devices = known.devices;
  const MethodParameters parameters = load_method_parameters(options.parameters);
  const robot::RobotOptions& robot_options = options.robot;
  require_fit(robot_options.layout, devices);
  robot::MasterBuses buses = open_buses(options.can, devices);

  std::unique_ptr<robot::KernelLockstepCycle> lockstep;
  std::unique_ptr<ProvenLockstep> proven;
  std::unique_ptr<robot::KernelRealTimeCycle> real_time;
  const std::string address = options.camera_address.empty() ? kDefaultCamera : options.camera_address;
  multisense::UdpPort port(address);
  // Before the first cycle, no time has passed for the master.
  const auto camera = open_camera(port, address, [&] {
    if (lockstep) return lockstep->now();
    return real_time ? real_time->now() : Time{};
  });
  GraspResult result;
  result.pacing = options.pacing;
  const bool is_lockstep = options.pacing == Pacing::kLockstep;

  std::vector<can::Interface*> interfaces;
  for (const auto& bus : buses) {
    interfaces.push_back(is_lockstep ? static_cast<can::Interface*>(&bus->restamped) : bus->socket.get());
  }
  const Time heartbeat = robot_options.heartbeat_producer;
  robot::HeartbeatPace pace(*interfaces.front(), heartbeat,
                            robot_options.cycle + (is_lockstep ? Time{} : heartbeat / 4));
  interfaces.front() = &pace;
  robot::Robot robot(known.model, devices, interfaces, robot_options);
  const auto require_pace = [&] {
    if (proven) proven->require();
    const auto interval = pace.wrong_interval();
    if (interval) throw_other_pace(*interval, robot_options, options.pacing);
  };
  const auto interrupted = [&] {
    require_pace();  // checked again below: the method may turn the exception into an ending
    return signals.arrived();
  };
  if (is_lockstep) {
    lockstep = std::make_unique<robot::KernelLockstepCycle>(robot, buses, robot_options.cycle, interrupted);
    proven = std::make_unique<ProvenLockstep>(*lockstep, pace, robot_options);
  } else {
    real_time = std::make_unique<robot::KernelRealTimeCycle>(buses, robot_options.cycle, interrupted);
    camera->set_waiting(multisense::Camera::Waiting::kPoll);
  }
  robot::Cycle& cycle = is_lockstep ? static_cast<robot::Cycle&>(*proven) : *real_time;

  Watcher watcher(events, result, lockstep ? lockstep->now() : real_time->now());
  std::optional<std::string> defect;
  try {
    regrasp::Regrasp method(
        known, robot, cycle, *camera, parameters, watcher,
        is_lockstep ? regrasp::Thinking::kBetweenCycles : regrasp::Thinking::kWhileHolding);
    const regrasp::Report report = method.run();
    result.outcome = to_string(report.ending);
    result.reason = report.hindrance;
    result.done = report.ending != regrasp::Ending::kRegraspLimit;
  } catch (const regrasp::RunStopped& stop) {
    result.outcome = "stopped";
    result.reason = stop.what();
  } catch (const robot::Interrupted& stop) {
    result.outcome = "stopped";
    result.reason = stop.what();
  } catch (const std::exception& e) {
    defect = e.what();
  }
  // Quick stop and NMT stop, followed by a SYNC, which in lock-step makes them take effect.
  robot.stop();
  robot.sync(lockstep ? lockstep->now() : real_time->now());
  // A kernel's short transmit queue accepts them gradually; where it has not accepted them in time, the
  // drives stop because of the missing heartbeat.
  for (const auto& bus : buses) static_cast<void>(bus->socket->flush_all(kStopLimit));
  require_pace();
  if (lockstep) result.incomplete = lockstep->incomplete();
  if (real_time) result.overruns = real_time->overruns();
  if (defect) throw std::logic_error(*defect);
  result.counters = robot.counters();
  return result;
}

}  // namespace walkman::apps
