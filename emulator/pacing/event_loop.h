#pragma once

#include <functional>
#include <memory>

#include "drivers/time.h"

namespace walkman::pacing {

/// Waits for file descriptors (epoll) and calls their handlers. For one thread.
class EventLoop {
 public:
  using Handler = std::function<void()>;

  /// Throws std::runtime_error if the system provides no epoll descriptor.
  EventLoop();
  ~EventLoop();
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  /// Calls `on_readable` in every `wait` that finds `descriptor` readable, in error or hung up. Replaces the
  /// handler of a descriptor that is already watched. Throws std::runtime_error if it cannot be watched.
  void add(int descriptor, Handler on_readable);

  /// Stops watching the descriptor. Allowed from a handler, and after the descriptor was closed.
  void remove(int descriptor) noexcept;

  /// Waits at most `limit` (negative: without limit) and calls the handlers. Returns early on a signal.
  void wait(Time limit);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace walkman::pacing
