#include "emulator/clock/host_scheduling.h"

#include <sched.h>

namespace walkman::clock {

void wait_for_senders() noexcept {
  cpu_set_t processors;
  if (sched_getaffinity(0, sizeof processors, &processors) != 0 || CPU_COUNT(&processors) > 1) return;
  if (sched_getscheduler(0) != SCHED_OTHER) return;
  const sched_param none{};
  (void)sched_setscheduler(0, SCHED_BATCH, &none);  // without it frames are answered all the same
}

}  // namespace walkman::clock
