#include "drivers/robot/lockstep_cycle.h"

#include <chrono>

#include <poll.h>

namespace walkman::apps {
namespace {

using Host = std::chrono::steady_clock;

constexpr int kWaitMs = 100;  // between two looks at whether the run is to end

}  // namespace

Time KernelLockstepCycle::next() {
  if (interrupted_()) throw Interrupted();
  now_ += period_;
  for (const auto& bus : buses_) {
    bus->restamped.flush();
    bus->restamped.set_time(now_);
  }
  robot_.collect(now_);
  const auto deadline = Host::now() + kPatience;
  std::vector<pollfd> waits;
  while (!robot_.settled()) {
    if (Host::now() >= deadline) {
      ++incomplete_;
      break;
    }
    waits.clear();
    for (const auto& bus : buses_) waits.push_back({bus->socket->descriptor(), POLLIN, 0});
    (void)poll(waits.data(), waits.size(), kWaitMs);
    if (interrupted_()) throw Interrupted();
    robot_.collect(now_);
  }
  return now_;
}

}  // namespace walkman::apps
