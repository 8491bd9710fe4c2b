#include "drivers/robot/kernel_cycle.h"

#include <algorithm>
#include <cerrno>
#include <chrono>

#include <poll.h>
#include <time.h>

namespace walkman::robot {
namespace {

using Host = std::chrono::steady_clock;

constexpr Time kWait = std::chrono::milliseconds(100);  // between two checks whether the run is to end

Time monotonic_now() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::chrono::seconds(t.tv_sec) + std::chrono::nanoseconds(t.tv_nsec);
}

}  // namespace

Time KernelLockstepCycle::next() {
  if (interrupted_()) throw Interrupted();
  now_ += period_;
  for (const auto& bus : buses_) {
    bus->restamped.flush();
    bus->restamped.set_time(now_);
  }
  robot_.collect(now_);
  const auto deadline = Host::now() + kLongestWait;
  while (!robot_.cycle_complete()) {
    if (Host::now() >= deadline) {
      ++incomplete_;
      break;
    }
    await_frames(kWait);
  }
  return now_;
}

void KernelLockstepCycle::hold(Time pause) {
  const auto end = Host::now() + pause;
  for (auto now = Host::now(); now < end; now = Host::now()) {
    await_frames(std::chrono::ceil<std::chrono::milliseconds>(std::min<Time>(end - now, kWait)));
  }
}

void KernelLockstepCycle::await_frames(Time limit) {
  std::vector<pollfd> waits;
  for (const auto& bus : buses_) waits.push_back({bus->socket->descriptor(), POLLIN, 0});
  const auto limit_ms = std::chrono::duration_cast<std::chrono::milliseconds>(limit).count();
  (void)poll(waits.data(), waits.size(), static_cast<int>(limit_ms));
  if (interrupted_()) throw Interrupted();
  robot_.collect(now_);
}

KernelRealTimeCycle::KernelRealTimeCycle(MasterBuses& buses, Time period, std::function<bool()> interrupted)
    : buses_(buses), period_(period), interrupted_(std::move(interrupted)), now_(monotonic_now()) {}

Time KernelRealTimeCycle::next() {
  for (const auto& bus : buses_) bus->socket->flush();
  Time next = now_ + period_;
  const Time present = monotonic_now();
  if (present > next) {
    const auto missed = (present + period_ / 2 - next) / period_ + 1;
    overruns_ += static_cast<std::uint64_t>(missed);
    next += missed * period_;
  }
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(next);
  const timespec until{seconds.count(), (next - seconds).count()};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
  // A process that was stopped or starved while sleeping wakes up cycles later.
  const auto slept_through = (monotonic_now() - next) / period_;
  overruns_ += static_cast<std::uint64_t>(slept_through);
  next += slept_through * period_;
  if (interrupted_()) throw Interrupted();
  now_ = next;
  return now_;
}

}  // namespace walkman::robot
