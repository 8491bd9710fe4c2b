#include "apps/replay/emulated_replay.h"

#include <algorithm>
#include <deque>
#include <queue>
#include <set>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/replay/master_frames.h"
#include "emulator/bus/frame_length.h"
#include "emulator/logs/candump_log.h"
#include "emulator/logs/candump_reader.h"
#include "urdf/reader/nearest_name.h"

namespace walkman::apps {
namespace {

// Longer than any frame takes: a log is in the order of the frames' ends, but they are played in the order of
// their beginnings.
constexpr Time kLookahead = std::chrono::milliseconds(20);
// From the last frame of a log to the end of the replay, for the last answers.
constexpr Time kEpilogue = std::chrono::milliseconds(5);
// A log whose stamps are beyond this has them by the wall clock, as candump's, and the emulated clock starts
// this much before its first frame.
constexpr Time kLongestRun = std::chrono::hours(24 * 365);
constexpr Time kBeforeFirst = std::chrono::milliseconds(1);

struct Played {
  Time begins;
  std::uint64_t place;  // in the log: breaks ties
  std::size_t bus;
  can::Frame frame;
  friend bool operator>(const Played& a, const Played& b) {
    return std::pair(a.begins, a.place) > std::pair(b.begins, b.place);
  }
};

/// Time from the start of a frame to the end of its last bit, which is when the log stamps it.
Time time_until_end(const can::Frame& frame, const bus::BusOptions& options) {
  bus::WireLength length = bus::wire_length(frame);
  length.nominal -= bus::kIntermissionBits;
  return bus::duration(length, options.bit_rate, options.data_bit_rate);
}

/// Pairs the frames of the log with those of the replay, one identifier at a time.
class Comparison {
 public:
  Comparison(std::vector<bus::CanBus*> buses, ReplayResult& result)
      : buses_(std::move(buses)), result_(result), pairs_(buses_.size()) {}

  void logged(std::size_t bus, const can::StampedFrame& frame) { take(bus, frame, true); }
  void replayed(std::size_t bus, const can::StampedFrame& frame) { take(bus, frame, false); }

  /// Counts the frames left without a partner, up to a time until which both sides are complete.
  void finish(Time until) {
    for (std::size_t bus = 0; bus < pairs_.size(); ++bus) {
      for (auto& [key, pair] : pairs_[bus]) {
        for (const can::StampedFrame& frame : pair.waiting) {
          if (!pair.of_log && frame.time > until) continue;
          ++(pair.of_log ? result_.missing : result_.extra);
          note(fmt::format("only in the {}: {}", pair.of_log ? "log" : "replay", text(bus, frame)));
        }
      }
    }
  }

 private:
  struct Pair {
    std::deque<can::StampedFrame> waiting;
    bool of_log = false;  // which side is ahead
  };

  void take(std::size_t bus, const can::StampedFrame& frame, bool of_log) {
    const std::uint32_t key = frame.frame.id | (frame.frame.extended ? 1U << 31U : 0U);
    Pair& pair = pairs_[bus][key];
    if (pair.waiting.empty() || pair.of_log == of_log) {
      pair.of_log = of_log;
      pair.waiting.push_back(frame);
      return;
    }
    const can::StampedFrame other = pair.waiting.front();
    pair.waiting.pop_front();
    if (other.frame == frame.frame) {
      ++result_.equal;
      result_.latest = std::max(result_.latest, std::chrono::abs(other.time - frame.time));
      return;
    }
    ++result_.different;
    note(fmt::format("log: {}  replay: {}", text(bus, of_log ? frame : other),
                     text(bus, of_log ? other : frame)));
  }

  void note(const std::string& difference) {
    if (result_.first.empty()) result_.first = difference;
  }
  [[nodiscard]] std::string text(std::size_t bus, const can::StampedFrame& frame) const {
    std::string line = bus::candump_line(buses_[bus]->interface_name(), frame);
    line.pop_back();  // its newline
    return line;
  }

  std::vector<bus::CanBus*> buses_;
  ReplayResult& result_;
  std::vector<std::map<std::uint32_t, Pair>> pairs_;  // by bus and identifier
};

/// Maps the interfaces of the log to buses.
class BusNames {
 public:
  BusNames(const ReplayOptions& options, const std::vector<bus::CanBus*>& buses)
      : file_(options.log.string()) {
    for (std::size_t i = 0; i < buses.size(); ++i) {
      places_[buses[i]->name()] = places_[std::string(buses[i]->interface_name())] = i;
      names_.push_back(buses[i]->name());
    }
    for (const auto& [interface, bus] : options.interfaces) {
      const auto found = std::find(names_.begin(), names_.end(), bus);
      if (found == names_.end()) {
        throw std::runtime_error(fmt::format("--from: there is no bus '{}', expected one of {}{}", bus,
                                             fmt::join(names_, ", "), did_you_mean(bus, names_)));
      }
      places_[interface] = static_cast<std::size_t>(found - names_.begin());
      unused_.insert(interface);
    }
  }

  [[nodiscard]] std::size_t place(const std::string& interface) {
    const auto found = places_.find(interface);
    unused_.erase(interface);
    if (found != places_.end()) return found->second;
    throw std::runtime_error(
        fmt::format("{}: interface {} is not one of the robot's buses ({}), expected --from BUS={}", file_,
                    interface, fmt::join(names_, ", "), interface));
  }

  /// Throws std::runtime_error if an interface was mapped that the log does not have.
  void require_used() const {
    if (!unused_.empty())
      throw std::runtime_error(
          fmt::format("--from: interface {} is not in {}", fmt::join(unused_, ", "), file_));
  }

 private:
  std::set<std::string> unused_;  // of those mapped by the options
  std::string file_;
  std::vector<std::string> names_;
  std::map<std::string, std::size_t> places_;
};

}  // namespace

ReplayResult replay_into_emulator(const ReplayOptions& options) {
  bus::CandumpReader reader(options.log);
  EmulatedWorld world(options.world);
  const std::vector<bus::CanBus*> buses = world.emulator.buses();
  BusNames names(options, buses);
  ReplayResult result;
  Comparison comparison(buses, result);
  for (std::size_t i = 0; i < buses.size(); ++i) {
    buses[i]->set_observer([&comparison, i](const can::StampedFrame& frame) {
      if (!is_from_master(frame.frame)) comparison.replayed(i, frame);
    });
  }

  const auto go_to = [&](Time until) {
    world.emulator.advance(until);
    world.emulator.carry(until);
    can::StampedFrame unread;
    for (bus::CanBus* bus : buses) {
      while (bus->computer_port().receive(unread)) {
      }
    }
  };
  std::priority_queue<Played, std::vector<Played>, std::greater<>> waiting;
  const auto play = [&](Time known) {
    while (!waiting.empty() && waiting.top().begins <= known) {
      const Played next = waiting.top();
      waiting.pop();
      // A nanosecond before it began, so that it takes part in that arbitration.
      go_to(next.begins - Time(1));
      if (buses[next.bus]->computer_port().send(next.frame) == can::SendResult::kQueued) ++result.given;
    }
  };

  bus::LoggedFrame logged;
  Time last{}, origin{};
  std::uint64_t place = 0;
  for (; reader.next(logged); ++place) {
    const std::size_t bus = names.place(logged.interface_name);
    can::StampedFrame& frame = logged.stamped;
    if (place == 0 && frame.time > kLongestRun) origin = frame.time - kBeforeFirst;
    frame.time = std::max(frame.time - origin, Time(1));
    if (options.gap && frame.time - last > kLongGap) options.gap(last, frame.time);
    last = std::max(last, frame.time);
    if (frame.frame.error) continue;
    if (is_from_master(frame.frame)) {
      Time begins = frame.time;
      if (options.world.bus_timing) begins -= time_until_end(frame.frame, buses[bus]->options());
      waiting.push({std::max(begins, Time(1)), place, bus, frame.frame});
    } else {
      comparison.logged(bus, frame);
    }
    play(frame.time - kLookahead);
  }
  if (place == 0) throw std::runtime_error(options.log.string() + ": there is no frame in it");
  names.require_used();
  play(Time::max());
  go_to(std::max(last, world.emulator.buses_now()) + kEpilogue);
  comparison.finish(last);
  result.seconds = std::chrono::duration<double>(last).count();
  return result;
}

}  // namespace walkman::apps
