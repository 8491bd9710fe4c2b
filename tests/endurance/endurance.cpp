// Hours of emulated time with the whole robot on its five embedded buses and the driver layer at the other
// end: nothing may leak, drift or get lost, and counters must wrap around.

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <unistd.h>

#include "drivers/robot/robot.h"
#include "emulator/emulator.h"
#include "tests/rigs/robot_without_plant.h"

namespace {

using namespace walkman;

constexpr Time kCycle = std::chrono::milliseconds(5);
constexpr std::uint32_t kSync = 0x080;
/// Growth of resident memory attributed to noise of the allocator and the kernel's page accounting.
constexpr long kFlatBytes = 256 * 1024;

struct Options {
  double seconds = 3600;
  double start = 0;
  bool plant = false;
};

double seconds(Time t) { return std::chrono::duration<double>(t).count(); }

long resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  long pages = 0;
  long resident = 0;
  statm >> pages >> resident;
  return resident * sysconf(_SC_PAGESIZE);
}

/// The robot with or without physics, reduced to what this program needs.
struct Subject {
  std::vector<can::Interface*> interfaces;
  std::vector<bus::CanBus*> buses;
  std::function<void(Time)> advance;
  std::shared_ptr<void> owner;
};

Subject without_plant(const rigs::RobotFiles& files, Time start) {
  auto robot = std::make_shared<rigs::RobotWithoutPlant>(files);
  if (start > Time{}) robot->start_at(start);
  Subject subject;
  subject.interfaces = robot->interfaces();
  for (const auto& bus : robot->buses()) subject.buses.push_back(bus.get());
  subject.advance = [raw = robot.get()](Time until) { raw->advance(until); };
  subject.owner = robot;
  return subject;
}

Subject with_plant(const rigs::RobotFiles& files, const std::filesystem::path& source) {
  EmulatorOptions options;
  options.actuators = source / "emulator/plant/actuators";
  auto emulator = std::make_shared<Emulator>(files.robot, files.devices, files.scene, options);
  Subject subject;
  subject.interfaces = emulator->interfaces();
  subject.buses = emulator->buses();
  subject.advance = [raw = emulator.get()](Time until) { raw->advance(until); };
  subject.owner = emulator;
  return subject;
}

/// Observes the frames on one bus.
struct Witness {
  std::string name;
  std::uint64_t syncs = 0;
  Time first_sync{};
  Time worst_sync_drift{};
  std::uint64_t tpdo1 = 0;
  std::uint64_t heartbeats = 0;

  void take(const can::StampedFrame& stamped) {
    const std::uint32_t function = stamped.frame.id & 0x780U;
    if (stamped.frame.id == kSync) {
      if (syncs == 0) first_sync = stamped.time;
      const Time due = first_sync + static_cast<std::int64_t>(syncs) * kCycle;
      worst_sync_drift = std::max(worst_sync_drift, std::max(stamped.time - due, due - stamped.time));
      ++syncs;
    } else if (function == 0x180) {
      ++tpdo1;
    } else if (function == 0x700) {
      ++heartbeats;
    }
  }
};

class Report {
 public:
  void require(bool held, const std::string& what) {
    std::printf("%s  %s\n", held ? "ok    " : "FAILED", what.c_str());
    all_ = all_ && held;
  }
  [[nodiscard]] bool all() const { return all_; }

 private:
  bool all_ = true;
};

int run(const Options& options) {
  const std::filesystem::path source = WALKMAN_SOURCE_TREE;
  const rigs::RobotFiles files(source / "urdf");
  const Time start = std::chrono::duration_cast<Time>(std::chrono::duration<double>(options.start));
  const Subject subject = options.plant ? with_plant(files, source) : without_plant(files, start);
  std::vector<Witness> witnesses(subject.buses.size());

  Time now = start + kCycle;
  robot::Robot robot(files.robot, files.devices, subject.interfaces);
  subject.advance(now);
  while (!robot.boot(now)) subject.advance(now += kCycle);
  for (std::size_t i = 0; i < subject.buses.size(); ++i) {
    witnesses[i].name = subject.buses[i]->name();
    subject.buses[i]->set_observer([&witnesses, i](const can::StampedFrame& f) { witnesses[i].take(f); });
  }
  static_cast<void>(robot.read(now));
  std::vector<robot::JointCommand> commands(robot.joints().size());
  for (std::size_t i = 0; i < commands.size(); ++i)
    commands[i].link_position = robot.joints()[i].link_position;

  const auto cycles = static_cast<std::uint64_t>(options.seconds / seconds(kCycle));
  const std::uint64_t settled = std::min<std::uint64_t>(cycles / 10, 12'000);
  long resident_settled = 0;
  std::uint64_t wraps = 0;
  std::uint16_t last_counter = robot.sensors().front().sample_counter;
  for (std::uint64_t cycle = 0; cycle < cycles; ++cycle) {
    if (cycle == settled) resident_settled = resident_bytes();
    robot.write(commands);
    robot.sync(now);
    subject.advance(now += kCycle);
    if (!robot.read(now)) {
      std::fprintf(stderr, "endurance: the drivers latched a fault: %s\n", robot.fault()->text.c_str());
      return 1;
    }
    const std::uint16_t counter = robot.sensors().front().sample_counter;
    if (counter < last_counter) ++wraps;
    last_counter = counter;
    if (isatty(STDERR_FILENO) != 0 && cycle % 20'000 == 0) {
      std::fprintf(stderr, "\r%6.0f of %.0f s", static_cast<double>(cycle) * seconds(kCycle),
                   options.seconds);
    }
  }

  Report report;
  std::uint64_t frames = 0;
  for (std::size_t i = 0; i < witnesses.size(); ++i) {
    const Witness& witness = witnesses[i];
    const bus::BusCounters counters = subject.buses[i]->counters();
    frames += counters.frames;
    const std::size_t nodes = files.devices.buses[i].devices.size();
    report.require(witness.syncs == cycles, witness.name + ": " + std::to_string(witness.syncs) +
                                                " SYNCs in " + std::to_string(cycles) + " cycles");
    report.require(witness.worst_sync_drift == Time{}, witness.name + ": SYNC off its grid by at most " +
                                                           std::to_string(witness.worst_sync_drift.count()) +
                                                           " ns");
    report.require(witness.tpdo1 == cycles * nodes, witness.name + ": " + std::to_string(witness.tpdo1) +
                                                        " TPDO1 of " + std::to_string(nodes) +
                                                        " nodes, expected " + std::to_string(cycles * nodes));
    // Every node and the master send ten heartbeats per second; a period may begin before and end after the
    // run.
    const double beats = options.seconds * 10 * static_cast<double>(nodes + 1);
    report.require(std::abs(static_cast<double>(witness.heartbeats) - beats) <= 2.0 * (nodes + 1),
                   witness.name + ": " + std::to_string(witness.heartbeats) + " heartbeats, expected " +
                       std::to_string(static_cast<std::uint64_t>(beats)));
    report.require(counters.lost == 0 && counters.transmit_overflows == 0,
                   witness.name + ": no frame lost, no transmit queue overflowed");
  }
  const robot::Counters counters = robot.counters();
  report.require(counters.receive_overflows == 0 && counters.frames_not_sent == 0,
                 "drivers: no frame lost in a queue");
  report.require(counters.frames_ignored == 0, "drivers: " + std::to_string(counters.frames_ignored) +
                                                   " frames of no use among " +
                                                   std::to_string(counters.frames_received));
  const double samples = options.seconds * 1000;
  report.require(std::abs(static_cast<double>(wraps) - samples / 65536) <= 1,
                 "sensor's 16-bit sample counter passed its end " + std::to_string(wraps) + " times");
  const long growth = resident_bytes() - resident_settled;
  report.require(growth <= kFlatBytes, "resident memory grew by " + std::to_string(growth / 1024) +
                                           " KiB after the first " + std::to_string(settled / 200) + " s");
  std::printf("%.0f s of emulated time from %.3f s, %llu frames\n", options.seconds, options.start,
              static_cast<unsigned long long>(frames));
  return report.all() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app{"Runs the whole robot on the embedded buses for a long emulated time and judges what is left"};
  app.add_option("--seconds", options.seconds, "emulated time")->capture_default_str();
  app.add_option("--start", options.start, "reading of the emulated clock at power-on, s");
  app.add_flag("--plant", options.plant, "with physics and camera instead of encoders that stand still");
  CLI11_PARSE(app, argc, argv);
  return run(options);
}
