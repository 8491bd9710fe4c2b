#pragma once

#include <functional>
#include <memory>

#include "drivers/can/frame.h"

namespace walkman::clock {

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

  /// Watches a descriptor again that was closed and opened anew behind the loop's back (a network interface
  /// that was deleted and came back may get the same number). No effect on one that is still watched.
  void refresh(int descriptor) noexcept;

  /// Makes `wait` return on the grid `first` + n `interval` of CLOCK_MONOTONIC. One system call here, none
  /// later.
  void set_tick(Time first, Time interval);
  /// Makes one `wait` return at `when` (CLOCK_MONOTONIC); replaces the instant set before, Time::max() takes
  /// it back.
  void set_alarm(Time when);

  /// Waits at most `limit` (negative: without limit, in whole milliseconds rounded up) and calls the
  /// handlers. Returns early for a signal.
  void wait(Time limit);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace walkman::clock
