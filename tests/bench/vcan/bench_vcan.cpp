// Response time of one emulated limb bus over the kernel's vcan, compared with the time that the kernel
// itself takes in the same run: a process that only echoes. To be run by vcan-setup/guest, or on a host after
// vcan-setup/host-up.

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <numeric>
#include <stdexcept>
#include <thread>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include "tests/bench/vcan/bus_socket.h"
#include "tests/bench/vcan/child_process.h"
#include "tests/bench/vcan/limb_client.h"

namespace {

using walkman::bench::BusSocket;
using walkman::bench::ChildProcess;
using walkman::bench::frame_of;
using walkman::bench::LimbClient;
using walkman::bench::SteadyClock;

constexpr int kWarmUp = 200;
constexpr std::uint32_t kEchoOne = 0x7A0, kEchoBurst = 0x7A1, kEcho = 0x7B0;
constexpr unsigned kBurst = 18;  // TPDOs of nine nodes, two each

/// Median and 99th percentile, in us.
struct Spread {
  double p50 = 0, p99 = 0, rate = 0;
};

template <typename Action>
Spread measure(int count, const Action& action) {
  for (int at = 0; at < kWarmUp; ++at) action();
  std::vector<double> took;
  const auto started = SteadyClock::now();
  for (int at = 0; at < count; ++at) {
    const auto before = SteadyClock::now();
    action();
    took.push_back(std::chrono::duration<double, std::micro>(SteadyClock::now() - before).count());
  }
  const double seconds = std::chrono::duration<double>(SteadyClock::now() - started).count();
  std::sort(took.begin(), took.end());
  return {took[took.size() / 2], took[took.size() * 99 / 100], count / seconds};
}

void print(const char* what, const Spread& spread, const Spread& floor) {
  fmt::print("{:<58} {:8.0f} {:8.0f} {:9.0f} {:10.0f} {:7.2f}\n", what, spread.p50, spread.p99, spread.rate,
             floor.p50, spread.p50 / floor.p50);
  std::fflush(stdout);
}

/// The other end of the floor measurement: answers a frame with one frame, or with a burst.
[[noreturn]] void echo(const std::string& interface) {
  BusSocket bus(interface);
  std::vector<can_frame> burst(kBurst, frame_of(kEcho, {1, 2, 3, 4, 5, 6, 7, 8}));
  for (;;) {
    try {
      bus.receive_until([&](const can_frame& frame) {
        if (frame.can_id == kEchoOne) bus.send(burst[0]);
        if (frame.can_id == kEchoBurst) bus.send(burst.data(), kBurst);
        return false;
      });
    } catch (const std::runtime_error&) {  // nothing arrived for a second
    }
  }
}

struct Floors {
  Spread one, burst;
};

Floors measure_floors(const std::string& interface, int count) {
  const ChildProcess echoing([&] { echo(interface); });
  BusSocket bus(interface);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  const auto ask = [&](std::uint32_t can_id, unsigned answers) {
    bus.send(frame_of(can_id, {1, 2, 3, 4, 5, 6, 7, 8}));
    bus.receive_until([&](const can_frame& frame) { return frame.can_id == kEcho && --answers == 0; });
  };
  return {measure(count, [&] { ask(kEchoOne, 1); }), measure(count, [&] { ask(kEchoBurst, kBurst); })};
}

void measure_limb(const std::string& interface, int count, const Floors& floors,
                  const std::function<void()>& alive) {
  BusSocket bus(interface);
  LimbClient limb(bus);
  limb.boot(60, alive);
  print("SDO expedited upload, round trip",
        measure(count, [&] { limb.upload_statusword(walkman::bench::kDrive); }), floors.one);

  limb.start(walkman::bench::kDrive);
  const can_frame rpdo = frame_of(0x200u + walkman::bench::kDrive, {0, 0, 8, 0, 0});
  const auto loop = [&] {
    bus.send(rpdo);
    limb.sync_and_await(2);
  };
  print("RPDO and SYNC to both TPDOs of one operational drive", measure(count, loop), floors.one);

  limb.hand_answers_every_sync();
  limb.start(0);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  bus.drain();
  print("SYNC to the last of 18 TPDOs, nine nodes operational",
        measure(count, [&] { limb.sync_and_await(static_cast<int>(kBurst)); }), floors.burst);

  std::vector<can_frame> commands;
  for (const int node : walkman::bench::kNodes) {
    if (node != 18) commands.push_back(frame_of(0x200u + static_cast<unsigned>(node), {0, 0, 8, 0, 0}));
  }
  const auto cycle = [&] {
    bus.send(commands.data(), static_cast<unsigned>(commands.size()));
    limb.sync_and_await(static_cast<int>(kBurst));
  };
  print("8 RPDOs and SYNC to the last of 18 TPDOs", measure(count, cycle), floors.burst);
}

int run(const std::string& interface, const std::string& program, const std::string& scene, bool attach,
        int count) {
  fmt::print("{:<58} {:>8} {:>8} {:>9} {:>10} {:>7}\n", "over " + interface, "p50 us", "p99 us", "a second",
             "floor us", "ratio");
  const Floors floors = measure_floors(interface, count);
  print("floor: a frame and its echo by another process", floors.one, floors.one);
  print("floor: a frame and 18 by another process", floors.burst, floors.burst);
  if (attach) {
    measure_limb(interface, count, floors, [] {});
    return 0;
  }
  const ChildProcess emulator(std::vector<std::string>{
      program, "emulate", "--scene", scene, "--can", "rarm=" + interface, "--realtime", "--timing", "none"});
  measure_limb(interface, count, floors, [&] {
    if (!emulator.running()) throw std::runtime_error(program + " emulate has ended");
  });
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "walkman-vcan-bench: how fast one emulated limb bus with its nine nodes answers over vcan, and what an "
      "echo "
      "takes"};
  std::string interface = "vcan1", scene = WALKMAN_URDF_DIR "/scenes/experiment_1.yaml";
  std::string program =
      (std::filesystem::read_symlink("/proc/self/exe").parent_path() / "walkman-hil").string();
  int count = 5000;
  bool attach = false;
  app.add_option("--interface", interface, "CAN interface")->capture_default_str();
  app.add_option("--program", program, "the walkman-hil to run")->capture_default_str();
  app.add_option("--scene", scene, "its scene")->capture_default_str();
  app.add_option("--count", count, "of each measurement")
      ->capture_default_str()
      ->check(CLI::Range(100, 10000000));
  app.add_flag("--attach", attach, "measure an emulator that is running already");
  CLI11_PARSE(app, argc, argv);
  try {
    return run(interface, program, scene, attach, count);
  } catch (const std::exception& e) {
    fmt::print(stderr, "walkman-vcan-bench: {}\n", e.what());
    return 3;
  }
}
