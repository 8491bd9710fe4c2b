#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

namespace walkman::sensors {

/// Threads that share out numbered jobs. Jobs run with denormal numbers flushed to zero, in the calling
/// thread as in the others, so a result does not depend on which thread computed it.
class WorkerPool {
 public:
  /// `threads` includes the caller of `run`; at least 1.
  explicit WorkerPool(int threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  [[nodiscard]] int threads() const { return static_cast<int>(workers_.size()) + 1; }

  /// Calls `job(index, worker)` for each index in 0..`jobs`−1, with `worker` in 0..threads()−1, and returns
  /// when all are done. `job` must not throw. Not to be called from a job.
  template <typename Job>
  void run(int jobs, const Job& job) {
    run_erased(
        jobs, [](const void* f, int index, int worker) { (*static_cast<const Job*>(f))(index, worker); },
        &job);
  }

 private:
  using Call = void (*)(const void* job, int index, int worker);
  void run_erased(int jobs, Call call, const void* job);
  void work(int worker);
  void serve(int worker);

  std::mutex mutex_;
  std::condition_variable start_, done_;
  std::uint64_t round_ = 0;
  int busy_ = 0;
  bool stop_ = false;
  Call call_ = nullptr;
  const void* job_ = nullptr;
  int jobs_ = 0;
  std::atomic<int> next_{0};
  std::vector<std::thread> workers_;
};

}  // namespace walkman::sensors
