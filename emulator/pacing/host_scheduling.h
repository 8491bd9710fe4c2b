#pragma once

namespace walkman::clock {

/// Where there is one processor only, as in a small virtual machine, lets whoever sends frames to the calling
/// thread finish a burst: its waking, by a frame or by its clock, no longer takes the processor from a
/// program that runs. Otherwise each frame of a burst costs two changes of process. SCHED_BATCH of sched(7);
/// a policy other than the normal one was the user's choice and stays.
void let_bursts_finish() noexcept;

/// Has the calling thread run when nothing else wants to: on one processor SCHED_IDLE, which any waking
/// thread interrupts, also one that lets bursts finish; on several, a little behind the others.
void stay_behind() noexcept;

}  // namespace walkman::clock
