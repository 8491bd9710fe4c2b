#include "emulator/pacing/host.h"

#include <cstdint>

#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

namespace walkman::pacing {
namespace {

constexpr int kNice = 5;
constexpr std::uint64_t kShortSlice = 100'000;  // ns, the shortest possible

/// Ignores failure: frames are answered without the policy, too.
void choose(int policy) noexcept {
  const sched_param none{};
  if (sched_getscheduler(0) == SCHED_OTHER) (void)sched_setscheduler(0, policy, &none);
}

bool one_processor() noexcept {
  cpu_set_t processors;
  return sched_getaffinity(0, sizeof processors, &processors) == 0 && CPU_COUNT(&processors) == 1;
}

}  // namespace

Time host_now() noexcept {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::chrono::seconds(t.tv_sec) + std::chrono::nanoseconds(t.tv_nsec);
}

void pause_until(Time host) noexcept {
  const auto whole = std::chrono::duration_cast<std::chrono::seconds>(host);
  const timespec until{whole.count(), (host - whole).count()};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
}

void let_bursts_finish() noexcept {
  if (one_processor()) choose(SCHED_BATCH);
}

void go_first() noexcept {
  if (sched_getscheduler(0) != SCHED_OTHER) return;
  // Threads that this one starts, which cast rays, have the normal policy.
  const sched_param lowest{.sched_priority = sched_get_priority_min(SCHED_FIFO)};
  if (!one_processor() && sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &lowest) == 0) return;
  struct {
    std::uint32_t size = sizeof(*this), policy = SCHED_OTHER;
    std::uint64_t flags = 0;
    std::int32_t nice = 0;
    std::uint32_t priority = 0;
    std::uint64_t runtime = kShortSlice, deadline = 0, period = 0;
  } attributes;
  attributes.nice = getpriority(PRIO_PROCESS, 0);
  (void)syscall(SYS_sched_setattr, 0, &attributes, 0U);
}

void take_turns() noexcept {
  const sched_param none{};
  if (sched_getscheduler(0) == (SCHED_FIFO | SCHED_RESET_ON_FORK)) sched_setscheduler(0, SCHED_OTHER, &none);
}

void stay_behind() noexcept {
  setpriority(PRIO_PROCESS, 0, kNice);  // of this thread only, on Linux
  if (one_processor()) choose(SCHED_IDLE);
}

}  // namespace walkman::pacing
