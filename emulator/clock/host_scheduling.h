#pragma once

namespace walkman::clock {

/// Where there is one processor only, as in a small virtual machine, lets whoever sends frames to the calling
/// thread finish a burst: its waking no longer takes the processor from a program that runs. Each frame of a
/// burst would cost two changes of process. SCHED_BATCH of sched(7); a policy other than the normal one was
/// the user's choice and stays.
void wait_for_senders() noexcept;

}  // namespace walkman::clock
