#pragma once

#include "drivers/time.h"

namespace walkman::pacing {

/// CLOCK_MONOTONIC of the machine the emulator runs on. Of the emulator and the programs around it nothing
/// else asks the host for the time.
[[nodiscard]] Time host_now() noexcept;

/// Pauses the calling thread until `host_now` is at least this, or a signal comes.
void pause_until(Time host) noexcept;

/// Where there is one processor only, as in a small virtual machine, lets whoever sends frames to the calling
/// thread finish a burst: its waking, by a frame or by its clock, no longer takes the processor from a
/// program that runs. Otherwise each frame of a burst costs two changes of process. SCHED_BATCH of sched(7);
/// a policy other than the normal one was the user's choice and stays.
void let_bursts_finish() noexcept;

/// Has the calling thread, which runs for less than a millisecond at a time, take the processor from others
/// as soon as it wakes: in real time (SCHED_FIFO of sched(7), the lowest priority) where there are several
/// processors and the user may (`ulimit -r`); else with a slice of 0.1 ms instead of some milliseconds
/// (sched_setattr(2); Linux 6.12 and later, others ignore it). A policy other than the normal one stays.
void go_first() noexcept;

/// Ends what `go_first` began, of a thread that runs longer than was thought: in real time it would keep
/// others from a processor.
void take_turns() noexcept;

/// Has the calling thread run when nothing else wants to: on one processor SCHED_IDLE, which any waking
/// thread interrupts, also one that lets bursts finish; on several, a little behind the others.
void stay_behind() noexcept;

}  // namespace walkman::pacing
