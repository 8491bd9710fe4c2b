#pragma once

#include <functional>
#include <memory>

#include "drivers/time.h"

namespace walkman::pacing {

/// Waits for file descriptors (epoll) and calls who asked for them. One thread.
class EventLoop {
 public:
  using Handler = std::function<void()>;

  /// Throws std::runtime_error when the system gives no epoll descriptor.
  EventLoop();
  ~EventLoop();
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  /// Calls `on_readable` in every `wait` that finds `descriptor` readable, in error or hung up. A descriptor
  /// that is watched already gets the new handler. Throws std::runtime_error when it cannot be waited for.
  void add(int descriptor, Handler on_readable);

  /// Forgets it; also allowed from a handler, and after it was closed.
  void remove(int descriptor) noexcept;

  /// Waits at most `limit` (negative: without limit) and calls the
  /// handlers. Returns early for a signal.
  void wait(Time limit);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace walkman::pacing
