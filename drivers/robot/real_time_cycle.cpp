#include "drivers/robot/real_time_cycle.h"

#include <cerrno>

#include <time.h>

namespace walkman::apps {
namespace {

Time monotonic_now() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::chrono::seconds(t.tv_sec) + std::chrono::nanoseconds(t.tv_nsec);
}

}  // namespace

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
  // A process that was stopped or starved in its sleep wakes up cycles later.
  const auto slept_through = (monotonic_now() - next) / period_;
  overruns_ += static_cast<std::uint64_t>(slept_through);
  next += slept_through * period_;
  if (interrupted_()) throw Interrupted();
  now_ = next;
  return now_;
}

}  // namespace walkman::apps
