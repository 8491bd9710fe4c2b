#include "emulator/pacing/host_scheduling.h"

#include <sched.h>
#include <sys/resource.h>

namespace walkman::clock {
namespace {

constexpr int kNice = 5;

/// Without it frames are answered all the same.
void choose(int policy) noexcept {
  const sched_param none{};
  if (sched_getscheduler(0) == SCHED_OTHER) (void)sched_setscheduler(0, policy, &none);
}

bool one_processor() noexcept {
  cpu_set_t processors;
  return sched_getaffinity(0, sizeof processors, &processors) == 0 && CPU_COUNT(&processors) == 1;
}

}  // namespace

void let_bursts_finish() noexcept {
  if (one_processor()) choose(SCHED_BATCH);
}

void stay_behind() noexcept {
  setpriority(PRIO_PROCESS, 0, kNice);  // of this thread alone, on Linux
  if (one_processor()) choose(SCHED_IDLE);
}

}  // namespace walkman::clock
