#include "emulator/pacing/event_loop.h"

#include <array>
#include <cerrno>
#include <map>
#include <stdexcept>
#include <system_error>

#include <sys/epoll.h>
#include <unistd.h>

namespace walkman::pacing {
namespace {

constexpr int kEventsAtOnce = 32;

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error(what + " (" + std::generic_category().message(errno) + ")");
}

}  // namespace

struct EventLoop::Impl {
  ~Impl() {
    if (epoll >= 0) close(epoll);
  }

  int control(int operation, int descriptor) const noexcept {
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.fd = descriptor;
    return epoll_ctl(epoll, operation, descriptor, &event);
  }

  int epoll = -1;
  std::map<int, Handler> handlers;
};

EventLoop::EventLoop() : impl_(std::make_unique<Impl>()) {
  impl_->epoll = epoll_create1(EPOLL_CLOEXEC);
  if (impl_->epoll < 0) fail("event loop: no epoll");
}

EventLoop::~EventLoop() = default;

void EventLoop::add(int descriptor, Handler on_readable) {
  if (impl_->control(EPOLL_CTL_ADD, descriptor) != 0 && errno != EEXIST) {
    fail("event loop: descriptor " + std::to_string(descriptor) + " cannot be watched");
  }
  impl_->handlers[descriptor] = std::move(on_readable);
}

void EventLoop::remove(int descriptor) noexcept {
  impl_->control(EPOLL_CTL_DEL, descriptor);
  impl_->handlers.erase(descriptor);
}

void EventLoop::wait(Time limit) {
  const auto whole = std::chrono::duration_cast<std::chrono::seconds>(limit);
  const timespec timeout{whole.count(), (limit - whole).count()};
  std::array<epoll_event, kEventsAtOnce> events;
  const int count =
      epoll_pwait2(impl_->epoll, events.data(), kEventsAtOnce, limit < Time{} ? nullptr : &timeout, nullptr);
  for (int i = 0; i < count; ++i) {
    const auto found = impl_->handlers.find(events[static_cast<std::size_t>(i)].data.fd);
    if (found == impl_->handlers.end()) continue;
    const Handler handler = found->second;  // it may remove itself
    handler();
  }
}

}  // namespace walkman::pacing
