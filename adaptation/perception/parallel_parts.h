#pragma once

#include <algorithm>
#include <cstddef>

#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>
#include <oneapi/tbb/task_arena.h>

#ifdef __SANITIZE_THREAD__
extern "C" {
void __tsan_acquire(void* address);  // NOLINT(bugprone-reserved-identifier): the sanitizer's own names
void __tsan_release(void* address);  // NOLINT(bugprone-reserved-identifier)
}
#endif

namespace walkman::perception {

/// Calls `job(part)` for each part in 0..`parts`−1 on at most `threads` threads, including the caller's, and
/// returns when all are done. Exceptions from `job` are propagated.
template <typename Job>
void for_parts(int threads, int parts, const Job& job) {
  // More threads than processors would only cause a warning from TBB.
  tbb::task_arena arena(std::clamp(threads, 1, tbb::info::default_concurrency()));
#ifdef __SANITIZE_THREAD__
  // Debian's TBB is not instrumented: the sanitizer has to be told how it hands over jobs and waits for them,
  // through addresses that need not be read.
  static char begun, done;
  const auto told = [&](int part) {
    __tsan_acquire(&begun);
    job(part);
    __tsan_release(&done);
  };
  __tsan_release(&begun);
  arena.execute([&] { tbb::parallel_for(0, parts, told, tbb::simple_partitioner()); });
  __tsan_acquire(&done);
#else
  arena.execute([&] { tbb::parallel_for(0, parts, job, tbb::simple_partitioner()); });
#endif
}

/// Calls `job(first, last)` for the ranges of `length` that make up 0..`count`, on at most `threads` threads.
/// The ranges do not depend on `threads`: sums kept for each of them (index: first / length) and added up in
/// order are identical to the last bit.
template <typename Job>
void for_ranges(int threads, std::size_t count, std::size_t length, const Job& job) {
  const std::size_t parts = (count + length - 1) / length;
  if (parts == 1) return job(std::size_t{0}, count);
  for_parts(threads, static_cast<int>(parts), [&](int part) {
    const std::size_t first = static_cast<std::size_t>(part) * length;
    job(first, std::min(count, first + length));
  });
}

}  // namespace walkman::perception
