#include "apps/replay/kernel_replay.h"

#include <chrono>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/replay/master_frames.h"
#include "apps/shared/can_map.h"
#include "apps/shared/stop_signals.h"
#include "emulator/logs/candump_reader.h"
#include "emulator/pacing/host.h"

namespace walkman::apps {
namespace {

constexpr Time kLongestSleep = std::chrono::milliseconds(100);  // between two checks for a signal
constexpr Time kRetry = std::chrono::milliseconds(1);

/// Reads the error reports, the only incoming frames: a socket learns of bus-off only by reading them.
void watch_link(can::SocketCan& socket) {
  can::StampedFrame report;
  while (socket.receive(report)) {
  }
}

}  // namespace

KernelReplayResult replay_onto_kernel(const KernelReplayOptions& options, StopSignals& signals) {
  bus::CandumpReader reader(options.log);
  std::map<std::string, std::unique_ptr<can::SocketCan>> sockets;
  can::SocketCanOptions talks_only;
  talks_only.listens = false;
  for (const auto& [logged, interface] : options.interfaces)
    sockets[logged] = open_can(interface, talks_only);

  KernelReplayResult result;
  const Time began = pacing::host_now();
  std::optional<Time> first;
  std::set<std::string> seen;  // interfaces of the log
  Time last{};
  bus::LoggedFrame logged;
  while (reader.next(logged) && !signals.arrived()) {
    const auto found = sockets.find(logged.interface_name);
    seen.insert(logged.interface_name);
    const can::Frame& frame = logged.stamped.frame;
    if (found == sockets.end() || frame.error || (options.master_only && !is_from_master(frame))) {
      ++result.skipped;
      continue;
    }
    if (!first) first = last = logged.stamped.time;
    if (options.speed > 0) {
      const std::chrono::duration<double, std::nano> offset(
          static_cast<double>((logged.stamped.time - *first).count()) / options.speed);
      if (options.gap &&
          logged.stamped.time - last > std::chrono::duration<double>(kLongGap) * options.speed) {
        options.gap(last, logged.stamped.time);
      }
      const Time due = began + std::chrono::duration_cast<Time>(offset);
      while (pacing::host_now() < due && !signals.arrived()) {
        pacing::pause_until(std::min(due, pacing::host_now() + kLongestSleep));
      }
    }
    last = logged.stamped.time;
    if (signals.arrived()) break;
    can::SocketCan& socket = *found->second;
    watch_link(socket);
    can::SendResult sent = socket.send(frame);
    while (sent == can::SendResult::kQueueFull && !signals.arrived()) {
      pacing::pause_until(pacing::host_now() + kRetry);
      watch_link(socket);
      sent = socket.send(frame);
    }
    socket.flush();
    ++(sent == can::SendResult::kQueued ? result.sent : result.refused);
  }
  result.interrupted = signals.arrived();
  if (!result.interrupted && !first) {
    std::string given;
    for (const auto& [name, interface] : options.interfaces) given += (given.empty() ? "" : ", ") + name;
    throw std::runtime_error(
        fmt::format("{}: there is no frame of {} to send in it{}", options.log.string(), given,
                    seen.empty() ? "" : fmt::format("; it has frames of {}", fmt::join(seen, ", "))));
  }
  for (const auto& [logged_name, socket] : sockets) {
    while (!result.interrupted && !socket->flush_all(kLongestSleep)) {
      watch_link(*socket);
      result.interrupted = signals.arrived();
    }
    // Frames that were queued and never reached the kernel were not sent.
    const std::uint64_t lost = socket->statistics().dropped + socket->waiting();
    result.sent -= lost;
    result.refused += lost;
  }
  result.seconds = std::chrono::duration<double>(pacing::host_now() - began).count();
  return result;
}

}  // namespace walkman::apps
