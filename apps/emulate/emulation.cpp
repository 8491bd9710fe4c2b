#include "apps/emulate/emulation.h"

#include <stdexcept>

#include "apps/shared/exit_code.h"
#include "apps/shared/standard_streams.h"
#include "apps/shared/stop_signals.h"
#include "drivers/camera/multisense/udp_port.h"
#include "emulator/faults/fault_plan.h"
#include "emulator/logs/can_log.h"
#include "emulator/pacing/host.h"
#include "emulator/pacing/lockstep_pacer.h"
#include "emulator/pacing/real_time_pacer.h"

namespace walkman::apps {
namespace {

constexpr Time kHousekeeping = std::chrono::milliseconds(200);

double seconds(Time time) { return std::chrono::duration<double>(time).count(); }

/// Writes everything that the emulated buses carry to a file as it passes.
class FrameLog {
 public:
  FrameLog(const std::filesystem::path& file, Emulator& emulator, bool live_faults)
      : log_(bus::open_can_log(file, faults::log_note(emulator.injections(), live_faults))) {
    for (bus::CanBus* bus : emulator.buses()) {
      bus->set_observer([this, bus](const can::StampedFrame& f) { log_->write(bus->interface_name(), f); });
    }
  }

  /// Writes the frames so far, in order of time; to be called when all buses have reached the same instant.
  void commit() { log_->commit(); }
  void finish() { log_->flush(); }

 private:
  std::unique_ptr<bus::CanLog> log_;
};

}  // namespace

struct Emulation::Impl {
  explicit Impl(const EmulationOptions& given);

  /// A bus that is connected to a kernel interface.
  struct Port {
    Port(bus::CanBus& bus, std::unique_ptr<can::SocketCan> opened)
        : socket(std::move(opened)), bridge(bus, *socket) {}
    std::unique_ptr<can::SocketCan> socket;
    bus::Bridge bridge;
    int watched = -1;
    std::uint64_t generation = 0;
    bool readable = false;
  };

  void open_ports();
  void open_camera();
  void watch(Port& port);
  void keep_house(Time wall);
  void moved();
  [[nodiscard]] bool over() const { return world.emulator.buses_now() >= options.duration; }
  [[nodiscard]] std::vector<bus::Bridge*> bridges();
  [[nodiscard]] pacing::PacerEvents events();
  void run_lockstep(const Events& told);
  void run_real_time(const Events& told);
  void tell(Time wall, const Events& told);
  [[nodiscard]] bool all_booted();

  EmulationOptions options;
  EmulatedWorld world;
  pacing::EventLoop loop;
  std::vector<std::unique_ptr<Port>> ports;
  std::vector<std::function<void()>> listeners;  // called when the buses have advanced
  std::unique_ptr<FrameLog> log;
  std::unique_ptr<gateways::CameraServer> camera;
  std::unique_ptr<pacing::LockstepPacer> lockstep;
  std::unique_ptr<pacing::RealTimePacer> real_time;
  bool stop = false, booted = false;
  Time began{}, ended{}, housekept{};
};

Emulation::Impl::Impl(const EmulationOptions& given) : options(given), world(given.world) {
  open_ports();
  if (!options.log.empty())
    log = std::make_unique<FrameLog>(options.log, world.emulator, options.live_faults);
  open_camera();
  if (options.pacing == Pacing::kLockstep) {
    lockstep = std::make_unique<pacing::LockstepPacer>(world.emulator, bridges(), options.period, events());
  } else {
    const pacing::RealTimePacer::Options real_time_options{options.world.bus_timing, options.stalls};
    real_time =
        std::make_unique<pacing::RealTimePacer>(world.emulator, bridges(), real_time_options, events());
  }
}

void Emulation::Impl::open_ports() {
  const std::vector<bus::CanBus*> buses = world.emulator.buses();
  for (const CanAssignment& assignment : parse_can_map(options.can, world.robot.devices)) {
    ports.push_back(std::make_unique<Port>(*buses[assignment.bus],
                                           open_can(assignment.interface_name, can::device_side_options())));
    // Programs on a virtual interface see the controller's state.
    bus::ComputerPort& port = buses[assignment.bus]->computer_port();
    bus::ControllerOptions controller = port.options();
    controller.reports = bus::ErrorReports::kStates;
    port.configure(controller);
    watch(*ports.back());
  }
}

void Emulation::Impl::open_camera() {
  const bool named = !options.camera_address.empty();
  const std::string address = named ? options.camera_address : kDefaultCamera;
  static_cast<void>(multisense::parse_udp_address(address));
  try {
    camera = std::make_unique<gateways::CameraServer>(address, world.emulator.camera());
  } catch (const std::runtime_error& e) {
    if (named) throw EnvironmentError(e.what());
    say(std::string(e.what()) + "; going on without the camera");
  }
}

void Emulation::Impl::watch(Port& port) {
  if (port.watched >= 0) loop.remove(port.watched);
  port.watched = port.socket->descriptor();
  port.generation = port.socket->generation();
  loop.add(port.watched, [&port] { port.readable = true; });
}

/// Polls an interface that is down or gone; one that came back has a new socket.
void Emulation::Impl::keep_house(Time wall) {
  housekept = wall;
  for (const auto& port : ports) {
    if (port->socket->link() == can::LinkState::kDown) port->readable = true;
    if (port->socket->generation() != port->generation) watch(*port);
  }
}

void Emulation::Impl::moved() {
  if (log) log->commit();
  for (const auto& tell : listeners) tell();
}

std::vector<bus::Bridge*> Emulation::Impl::bridges() {
  std::vector<bus::Bridge*> all;
  for (const auto& port : ports) all.push_back(&port->bridge);
  return all;
}

pacing::PacerEvents Emulation::Impl::events() {
  pacing::PacerEvents events;
  events.moved = [this] { moved(); };
  events.published_at = [this](Time now) {
    if (camera) camera->publish(now);
  };
  return events;
}

/// Returns true when every bus has carried a frame for each of its nodes: they boot before they do anything
/// else.
bool Emulation::Impl::all_booted() {
  const std::vector<bus::CanBus*> buses = world.emulator.buses();
  for (std::size_t i = 0; i < buses.size(); ++i) {
    if (buses[i]->counters().frames < world.emulator.node_counts()[i]) return false;
  }
  return true;
}

void Emulation::Impl::tell(Time wall, const Events& told) {
  if (!booted && all_booted()) {
    booted = true;
    told.booted();
  }
  if (wall - housekept < kHousekeeping) return;
  keep_house(wall);
  told.progress();
}

void Emulation::Impl::run_lockstep(const Events& told) {
  lockstep->start();
  Time wall = began;
  tell(wall, told);
  while (!stop && !over()) {
    loop.wait(std::clamp(lockstep->wake_at(wall) - wall, Time{}, kHousekeeping));
    wall = pacing::host_now();
    bool arrived = false;
    for (std::size_t i = 0; i < ports.size(); ++i) {
      if (!ports[i]->readable) continue;
      ports[i]->readable = false;
      lockstep->receive(i, wall);
      arrived = true;
    }
    // The quiet period is over only if nothing arrived while waiting for its end.
    lockstep->run(arrived ? Time{} : wall);
    tell(wall, told);
  }
  // Frames that a master sent before the signal are still carried. At the end of a set duration they are not:
  // how many of the next cycle's frames have arrived by then depends on the host's speed.
  if (!stop) return;
  for (std::size_t i = 0; i < ports.size(); ++i) lockstep->receive(i, wall);
  lockstep->finish();
}

void Emulation::Impl::run_real_time(const Events& told) {
  pacing::go_first();
  real_time->start(began);
  Time wall = began;
  while (!stop && !over()) {
    loop.wait(std::max(Time{}, real_time->wake_at() - wall));
    wall = pacing::host_now();
    for (std::size_t i = 0; i < ports.size(); ++i) {
      if (!ports[i]->readable) continue;
      ports[i]->readable = false;
      real_time->note_arrival(i);
    }
    real_time->run(wall);
    if (real_time->lateness().worst > pacing::RealTimeSchedule::kLongestReplay) pacing::take_turns();
    tell(wall, told);
  }
}

Emulation::Emulation(const EmulationOptions& options) : impl_(std::make_unique<Impl>(options)) {}

Emulation::~Emulation() = default;

Emulator& Emulation::emulator() { return impl_->world.emulator; }

void Emulation::attach(int descriptor, std::function<void()> on_readable, std::function<void()> on_moved) {
  impl_->loop.add(descriptor, std::move(on_readable));
  impl_->listeners.push_back(std::move(on_moved));
}

void Emulation::run(StopSignals& signals, const Events& events) {
  pacing::let_bursts_finish();
  impl_->began = impl_->housekept = pacing::host_now();
  impl_->loop.add(signals.descriptor(), [this, &signals] { impl_->stop = signals.arrived(); });
  if (impl_->lockstep) {
    impl_->run_lockstep(events);
  } else {
    impl_->run_real_time(events);
  }
  impl_->loop.remove(signals.descriptor());
  impl_->ended = pacing::host_now();
}

EmulationSummary Emulation::summary() const {
  Impl& self = *impl_;
  EmulationSummary out;
  const Time wall = self.ended == Time{} ? pacing::host_now() : self.ended;
  out.pacing = self.options.pacing;
  out.model_error = self.world.scene.model_error.text();
  out.emulated_seconds = seconds(self.world.emulator.buses_now());
  out.wall_seconds = seconds(wall - self.began);
  if (self.lockstep) {
    out.cycles = self.lockstep->cycles();
  } else {
    out.lateness = self.real_time->lateness();
    out.behind_seconds = seconds(self.real_time->behind(wall));
  }
  if (self.camera) out.clouds = self.camera->served();
  out.faults = self.world.emulator.injections();
  for (bus::CanBus* bus : self.world.emulator.buses()) {
    BusSummary summary;
    summary.name = bus->name();
    summary.nodes = self.world.emulator.node_counts()[out.buses.size()];
    summary.bus = bus->counters();
    summary.load_now = bus->load();
    if (out.emulated_seconds > 0) {
      summary.load = seconds(summary.bus.busy) / out.emulated_seconds;
    }
    for (const auto& port : self.ports) {
      if (&port->bridge.bus() != bus) continue;
      summary.interface_name = std::string(port->socket->name());
      summary.bridge = port->bridge.counters();
      summary.receive_overflows = port->socket->receive_overflows();
    }
    out.buses.push_back(std::move(summary));
  }
  return out;
}

void Emulation::finish_log() {
  if (!impl_->log) return;
  try {
    impl_->log->finish();
  } catch (const std::runtime_error& e) {
    throw EnvironmentError(e.what());
  }
}

}  // namespace walkman::apps
