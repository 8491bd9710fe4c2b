#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "apps/shared/can_map.h"
#include "apps/shared/emulated_world.h"
#include "emulator/bus/bridge.h"
#include "emulator/gateways/camera_server.h"
#include "emulator/pacing/event_loop.h"
#include "emulator/pacing/real_time_schedule.h"

namespace walkman::apps {

class StopSignals;

struct EmulationOptions {
  WorldOptions world;
  std::string can;  ///< "torso=vcan0,rarm=vcan1"; the buses left out are emulated too, without a connection
  Pacing pacing = Pacing::kRealTime;
  pacing::Stalls stalls = pacing::Stalls::kDrop;  ///< in real time
  Time period = std::chrono::milliseconds(5);     ///< of SYNC, in lock-step
  std::filesystem::path log;                      ///< log file of all buses; none when empty
  bool live_faults = false;                       ///< faults may come while it runs; for the log's header
  std::string camera_address;                     ///< the default address when empty
  Time duration = Time::max();                    ///< emulated time; unlimited by default
};

/// Statistics of one bus.
struct BusSummary {
  std::string name;
  std::size_t nodes = 0;
  std::string interface_name;  ///< kernel interface; empty for a bus without a connection
  bus::BusCounters bus;
  bus::BridgeCounters bridge;
  std::uint64_t receive_overflows = 0;  ///< frames that the kernel lost before they were read
  double load = 0;                      ///< mean over the run, 0..1
  double load_now = 0;                  ///< over the last second
};

struct EmulationSummary {
  Pacing pacing{};
  double emulated_seconds = 0;
  double wall_seconds = 0;
  std::uint64_t cycles = 0;   ///< lock-step: SYNCs
  pacing::Lateness lateness;  ///< real time
  double behind_seconds = 0;  ///< real time: delay of the emulated clock at the end
  std::uint64_t clouds = 0;
  std::vector<BusSummary> buses;
  std::vector<faults::InjectionState> faults;  ///< those not cleared
  std::string model_error;                     ///< of the emulated robot, as requested
};

/// The emulated robot as one process on the kernel's CAN interfaces: all buses, bridges for those that are
/// mapped, the camera server, a log, and the clock that drives them.
class Emulation {
 public:
  /// Throws std::runtime_error for invalid input, EnvironmentError for an interface or socket that does not
  /// exist.
  explicit Emulation(const EmulationOptions& options);
  ~Emulation();
  Emulation(const Emulation&) = delete;
  Emulation& operator=(const Emulation&) = delete;

  [[nodiscard]] Emulator& emulator();

  /// Attaches another gateway to the buses: `on_readable` is called when `descriptor` is readable, `on_moved`
  /// each time the buses have advanced to a later instant, to hand out the frames they carried. Frames enter
  /// through a controller of the gateway (`CanBus::add_port`).
  void attach(int descriptor, std::function<void()> on_readable, std::function<void()> on_moved);

  /// Callbacks during a run.
  struct Events {
    std::function<void()>
        booted;  ///< once, when the boot-up messages of all nodes have gone over their buses
    std::function<void()> progress;  ///< about five times a second
  };

  /// Runs until a signal arrives or the duration is over.
  void run(StopSignals& signals, const Events& events);

  [[nodiscard]] EmulationSummary summary() const;

  /// Writes the log out to its file. Throws EnvironmentError if any part of it could not be written.
  void finish_log();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace walkman::apps
