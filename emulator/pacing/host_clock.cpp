#include "emulator/pacing/host_clock.h"

#include <time.h>

namespace walkman::clock {

Time host_now() noexcept {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::chrono::seconds(t.tv_sec) + std::chrono::nanoseconds(t.tv_nsec);
}

}  // namespace walkman::clock
