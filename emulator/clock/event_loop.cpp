#include "emulator/clock/event_loop.h"

#include <array>
#include <cerrno>
#include <map>
#include <stdexcept>
#include <system_error>

#include <sys/epoll.h>
#include <sys/timerfd.h>
#include <unistd.h>

namespace walkman::clock {
namespace {

constexpr int kEventsAtOnce = 32;

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error(what + " (" + std::generic_category().message(errno) + ")");
}

timespec to_timespec(Time time) {
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(time);
  return {seconds.count(), (time - seconds).count()};
}

}  // namespace

struct EventLoop::Impl {
  ~Impl() {
    for (const int descriptor : {epoll, tick, alarm}) {
      if (descriptor >= 0) close(descriptor);
    }
  }

  int control(int operation, int descriptor, std::uint32_t events) const noexcept {
    epoll_event event{};
    event.events = events;
    event.data.fd = descriptor;
    return epoll_ctl(epoll, operation, descriptor, &event);
  }

  /// A timer that is watched edge-triggered: it never has to be read.
  void set(int& timer, Time first, Time interval) {
    if (timer < 0) {
      timer = timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
      if (timer < 0) fail("event loop: no timer");
      if (control(EPOLL_CTL_ADD, timer, EPOLLIN | EPOLLET) != 0) fail("event loop: timer cannot be watched");
    }
    itimerspec spec{};
    if (first != Time::max()) {
      spec.it_value = to_timespec(std::max(first, Time(1)));
      spec.it_interval = to_timespec(interval);
    }
    if (timerfd_settime(timer, TFD_TIMER_ABSTIME, &spec, nullptr) != 0) fail("event loop: timer not set");
  }

  int epoll = -1, tick = -1, alarm = -1;
  std::map<int, Handler> handlers;
};

EventLoop::EventLoop() : impl_(std::make_unique<Impl>()) {
  impl_->epoll = epoll_create1(EPOLL_CLOEXEC);
  if (impl_->epoll < 0) fail("event loop: no epoll");
}

EventLoop::~EventLoop() = default;

void EventLoop::add(int descriptor, Handler on_readable) {
  if (impl_->control(EPOLL_CTL_ADD, descriptor, EPOLLIN) != 0 && errno != EEXIST) {
    fail("event loop: descriptor " + std::to_string(descriptor) + " cannot be watched");
  }
  impl_->handlers[descriptor] = std::move(on_readable);
}

void EventLoop::remove(int descriptor) noexcept {
  impl_->control(EPOLL_CTL_DEL, descriptor, 0);
  impl_->handlers.erase(descriptor);
}

void EventLoop::refresh(int descriptor) noexcept {
  if (impl_->handlers.contains(descriptor)) impl_->control(EPOLL_CTL_ADD, descriptor, EPOLLIN);
}

void EventLoop::set_tick(Time first, Time interval) { impl_->set(impl_->tick, first, interval); }

void EventLoop::set_alarm(Time when) { impl_->set(impl_->alarm, when, Time{}); }

void EventLoop::wait(Time limit) {
  int milliseconds = -1;
  if (limit >= Time{}) {
    milliseconds = static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(limit).count());
  }
  std::array<epoll_event, kEventsAtOnce> events;
  const int count = epoll_wait(impl_->epoll, events.data(), kEventsAtOnce, milliseconds);
  for (int i = 0; i < count; ++i) {
    const auto found = impl_->handlers.find(events[static_cast<std::size_t>(i)].data.fd);
    if (found == impl_->handlers.end()) continue;
    const Handler handler = found->second;  // it may remove itself
    handler();
  }
}

}  // namespace walkman::clock
