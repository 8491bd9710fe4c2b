// The whole emulator in real time: a robot balanced by its drivers over the buses, while a client receives
// every stereo frame, both images and the laser's scans from the camera over UDP.

#include <atomic>
#include <chrono>
#include <ctime>
#include <numbers>
#include <optional>
#include <thread>

#include <benchmark/benchmark.h>

#include "adaptation/regrasp/manipulator.h"
#include "adaptation/regrasp/session.h"
#include "apps/shared/emulated_world.h"
#include "drivers/camera/multisense/datagram.h"
#include "drivers/camera/multisense/messages.h"
#include "drivers/camera/multisense/udp_port.h"
#include "drivers/robot/robot.h"
#include "emulator/gateways/camera_server.h"
#include "emulator/pacing/host.h"
#include "emulator/pacing/real_time_schedule.h"

namespace {

using namespace walkman;
using namespace std::chrono_literals;

const std::filesystem::path kTree = std::filesystem::path(WALKMAN_URDF_DIR) / "..";
constexpr const char* kAddress = "127.9.11.1";
constexpr double kSeconds = 10;       // duration of the measurement
constexpr double kSpindleRate = 0.6;  // rad/s

double processor_seconds() {
  timespec used{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

/// Runs each physics step when it is due.
class RealTimeCycle final : public robot::Cycle {
 public:
  RealTimeCycle(Emulator& emulator, gateways::CameraServer& server)
      : emulator_(emulator), server_(server), schedule_(Emulator::kPhysicsStep, pacing::Stalls::kReplay) {
    pacing::go_first();
    schedule_.start(pacing::host_now(), emulator.now());
  }
  Time next() override {
    for (int step = 0; step < 5; ++step) {
      const Time due = schedule_.host(emulator_.now() + Emulator::kPhysicsStep);
      while (pacing::host_now() < due) pacing::pause_until(due);
      schedule_.begin_step(emulator_.now(), pacing::host_now());
      const Time began = pacing::host_now();
      emulator_.advance(emulator_.now() + Emulator::kPhysicsStep);
      busy_ += pacing::host_now() - began;
      server_.publish(emulator_.now());
    }
    return emulator_.now();
  }
  void restart() {
    schedule_ = pacing::RealTimeSchedule(Emulator::kPhysicsStep, pacing::Stalls::kReplay);
    schedule_.start(pacing::host_now(), emulator_.now());
    busy_ = {};
  }
  [[nodiscard]] const pacing::Lateness& lateness() const { return schedule_.lateness(); }
  [[nodiscard]] Time busy() const { return busy_; }

 private:
  Emulator& emulator_;
  gateways::CameraServer& server_;
  pacing::RealTimeSchedule schedule_;
  Time busy_{};
};

struct Got {
  int frames = 0, images = 0, scans = 0, lost = 0;
};

/// Receives the camera's streams in a separate thread.
class Watcher {
 public:
  Watcher() : thread_([this] { watch(); }) {}
  ~Watcher() {
    stop_ = true;
    thread_.join();
  }
  [[nodiscard]] Got got() const { return {frames_, images_, scans_, lost_}; }

 private:
  static constexpr std::uint64_t kWanted =
      multisense::source::kDisparityLeft | multisense::source::kLumaRectifiedLeft |
      multisense::source::kLumaRectifiedRight | multisense::source::kLidar;

  template <typename Message>
  void send(multisense::UdpPort& port, const Message& message) {
    const std::vector<std::uint8_t> bytes = multisense::encode(message);
    std::vector<std::uint8_t> datagram;
    multisense::Fragments(bytes, ++sequence_, multisense::kLeastMtu).next(datagram);
    port.send(datagram);
  }
  void watch() {
    multisense::UdpPort port(kAddress);
    multisense::Assembler assembler;
    std::vector<std::uint8_t> datagram;
    send(port, multisense::Mtu{multisense::kMostMtu});
    send(port, multisense::SetMotor{static_cast<float>(kSpindleRate * 60 / (2 * std::numbers::pi))});
    send(port, multisense::StreamControl{kWanted, kWanted});
    Time asked{};
    while (!stop_) {
      if (const Time now = pacing::host_now(); now - asked > 1s) {
        asked = now;
        send(port, multisense::Query::kStatus);
      }
      static_cast<void>(port.wait(10ms));
      while (port.receive(datagram)) {
        const auto message = assembler.take(datagram);
        if (message.empty()) continue;
        const std::uint16_t id = multisense::id_of(message).value_or(0);
        frames_ += id == multisense::Disparity::kId ? 1 : 0;
        images_ += id == multisense::Image::kId ? 1 : 0;
        scans_ += id == multisense::LidarData::kId ? 1 : 0;
      }
      lost_ = static_cast<int>(assembler.lost());
    }
  }
  std::uint16_t sequence_ = 0;
  std::atomic<int> frames_ = 0, images_ = 0, scans_ = 0, lost_ = 0;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

/// Without and with a client of the camera. Counters: ratio of emulated to real time, physics steps that
/// began more than a step late and the worst lateness, what the client received per second and what it lost,
/// and cores in use, by physics and buses alone and in total.
void BM_RealTime(benchmark::State& state) {
  apps::WorldOptions options;
  options.scene = kTree / "urdf/scenes/experiment_1.yaml";
  options.actuators = kTree / "emulator/plant/actuators";
  apps::EmulatedWorld world(options);
  gateways::CameraServer server(kAddress, world.emulator.camera());
  robot::Robot robot(world.robot.model, world.robot.devices, world.emulator.interfaces());
  RealTimeCycle cycle(world.emulator, server);
  regrasp::Observer observer;
  regrasp::Session session(world.robot, robot, cycle, observer);
  regrasp::Manipulator manipulator(world.robot, session, {});
  session.boot();
  manipulator.start();
  std::optional<Watcher> watching;
  if (state.range(0) != 0) watching.emplace();
  manipulator.hold(2);
  for (auto _ : state) {
    cycle.restart();
    const Got before = watching ? watching->got() : Got{};
    const Time emulated = world.emulator.now(), host = pacing::host_now();
    const double used = processor_seconds();
    manipulator.hold(kSeconds);
    const double wall = std::chrono::duration<double>(pacing::host_now() - host).count();
    state.counters["real_time_factor"] =
        std::chrono::duration<double>(world.emulator.now() - emulated).count() / wall;
    state.counters["late_steps"] = static_cast<double>(cycle.lateness().late);
    state.counters["worst_late_ms"] = 1e-6 * static_cast<double>(cycle.lateness().worst.count());
    if (watching) {
      const Got after = watching->got();
      state.counters["frames_per_s"] = (after.frames - before.frames) / wall;
      state.counters["images_per_s"] = (after.images - before.images) / wall;
      state.counters["scans_per_s"] = (after.scans - before.scans) / wall;
      state.counters["lost"] = after.lost - before.lost;
    }
    state.counters["loop_cores"] = std::chrono::duration<double>(cycle.busy()).count() / wall;
    state.counters["cores"] = (processor_seconds() - used) / wall;
  }
}
BENCHMARK(BM_RealTime)
    ->ArgName("camera")
    ->Arg(0)
    ->Arg(1)
    ->Iterations(1)
    ->Unit(benchmark::kSecond)
    ->UseRealTime();

}  // namespace
