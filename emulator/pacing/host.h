#pragma once

#include "drivers/time.h"

namespace walkman::pacing {

/// CLOCK_MONOTONIC of the machine the emulator runs on. Nothing else in the emulator and the programs around
/// it reads the host's time.
[[nodiscard]] Time host_now() noexcept;

/// Pauses the calling thread until `host_now` is at least `host`, or a signal arrives.
void pause_until(Time host) noexcept;

/// On a single processor, as in a small virtual machine, lets a program that sends frames to the calling
/// thread finish a burst: the thread, woken by a frame or by its clock, no longer preempts a running program.
/// Otherwise each frame of a burst costs two context switches. Uses SCHED_BATCH of sched(7); a policy other
/// than the normal one was the user's choice and is kept.
void let_bursts_finish() noexcept;

/// Makes the calling thread, which runs for less than a millisecond at a time, preempt others as soon as it
/// wakes: with real-time scheduling (SCHED_FIFO of sched(7), lowest priority) if there are several processors
/// and the user is permitted to (`ulimit -r`); otherwise with a slice of 0.1 ms instead of some milliseconds
/// (sched_setattr(2); Linux 6.12 and later, others ignore it). Keeps a policy other than the normal one.
void go_first() noexcept;

/// Reverts `go_first` for a thread that runs longer than expected: with real-time scheduling it would keep
/// others from a processor.
void take_turns() noexcept;

/// Makes the calling thread run when nothing else wants to: on one processor with SCHED_IDLE, which any
/// waking thread preempts, even one that lets bursts finish; on several, with slightly lower priority.
void stay_behind() noexcept;

}  // namespace walkman::pacing
