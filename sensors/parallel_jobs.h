#pragma once

#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>
#include <oneapi/tbb/task_arena.h>
#include <pmmintrin.h>
#include <xmmintrin.h>

namespace walkman::sensors {

/// Flush-to-zero and denormals-are-zero in the calling thread, as Embree recommends, for the lifetime of the
/// object.
class DenormalsFlushed {
 public:
  DenormalsFlushed() : before_(_mm_getcsr()) {
    _mm_setcsr(before_ | _MM_FLUSH_ZERO_ON | _MM_DENORMALS_ZERO_ON);
  }
  ~DenormalsFlushed() { _mm_setcsr(before_); }
  DenormalsFlushed(const DenormalsFlushed&) = delete;
  DenormalsFlushed& operator=(const DenormalsFlushed&) = delete;

 private:
  unsigned before_;
};

/// Calls `job(index, worker)` for each index in 0..`jobs`−1 on the arena's threads, the caller's among them,
/// and returns when all are done. `worker` is in 0..arena.max_concurrency()−1, and no two jobs with the same
/// one run at once. Jobs run with denormal numbers flushed to zero, so a result does not depend on which
/// thread computed it. `job` must not throw.
template <typename Job>
void run_jobs(tbb::task_arena& arena, int jobs, const Job& job) {
  arena.execute([&] {
    tbb::parallel_for(
        0, jobs,
        [&](int index) {
          const DenormalsFlushed guard;
          job(index, tbb::this_task_arena::current_thread_index());
        },
        tbb::simple_partitioner());
  });
}

}  // namespace walkman::sensors
