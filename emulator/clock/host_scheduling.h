#pragma once

namespace walkman::clock {

/// Lets whoever sends frames to the calling thread finish a burst: from now on its waking does not take the
/// processor from a program that runs. Matters where both share one processor, as in a small virtual machine:
/// each frame of a burst would cost two changes of process. SCHED_BATCH of sched(7); a policy other than the
/// normal one was the user's choice and stays.
void wait_for_senders() noexcept;

}  // namespace walkman::clock
