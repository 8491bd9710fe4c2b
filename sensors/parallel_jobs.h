#pragma once

#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>
#include <oneapi/tbb/task_arena.h>
#include <pmmintrin.h>
#include <xmmintrin.h>

#ifdef __SANITIZE_THREAD__
extern "C" {
void __tsan_acquire(void* address);  // NOLINT(bugprone-reserved-identifier): the sanitizer's own names
void __tsan_release(void* address);  // NOLINT(bugprone-reserved-identifier)
}
#endif

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
#ifdef __SANITIZE_THREAD__
  // Debian's TBB is not instrumented: the sanitizer must be told how it hands jobs over, separates workers
  // from each other and waits for them, by addresses that need not be read.
  static char begun, done, workers[64];
#endif
  arena.execute([&] {
    const auto body = [&](int index) {
#ifdef __SANITIZE_THREAD__
      __tsan_acquire(&begun);
#endif
      const DenormalsFlushed guard;
      const int worker = tbb::this_task_arena::current_thread_index();
#ifdef __SANITIZE_THREAD__
      __tsan_acquire(&workers[worker % 64]);
#endif
      job(index, worker);
#ifdef __SANITIZE_THREAD__
      __tsan_release(&workers[worker % 64]);
      __tsan_release(&done);
#endif
    };
#ifdef __SANITIZE_THREAD__
    __tsan_release(&begun);
#endif
    tbb::parallel_for(0, jobs, body, tbb::simple_partitioner());
  });
#ifdef __SANITIZE_THREAD__
  __tsan_acquire(&done);
#endif
}

}  // namespace walkman::sensors
