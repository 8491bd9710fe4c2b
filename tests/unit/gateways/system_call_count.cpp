// Counts the calls of the C library functions through which the gateways call the system. The functions in
// this file are found first.
#include "tests/unit/gateways/system_call_count.h"

#include <dlfcn.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/timerfd.h>
#include <unistd.h>

namespace walkman::gateways::test {

int system_calls = 0;

namespace {

template <typename Function>
Function* counted(const char* name) {
  ++system_calls;
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace
}  // namespace walkman::gateways::test

using walkman::gateways::test::counted;

extern "C" {

int epoll_wait(int epoll, epoll_event* events, int count, int timeout) {
  return counted<decltype(epoll_wait)>("epoll_wait")(epoll, events, count, timeout);
}
int epoll_ctl(int epoll, int operation, int descriptor, epoll_event* event) noexcept {
  return counted<decltype(epoll_ctl)>("epoll_ctl")(epoll, operation, descriptor, event);
}
int timerfd_settime(int timer, int flags, const itimerspec* next, itimerspec* before) noexcept {
  return counted<decltype(timerfd_settime)>("timerfd_settime")(timer, flags, next, before);
}
ssize_t read(int descriptor, void* data, size_t size) {
  return counted<decltype(read)>("read")(descriptor, data, size);
}
ssize_t write(int descriptor, const void* data, size_t size) {
  return counted<decltype(write)>("write")(descriptor, data, size);
}
ssize_t recv(int socket, void* data, size_t size, int flags) {
  return counted<decltype(recv)>("recv")(socket, data, size, flags);
}
ssize_t send(int socket, const void* data, size_t size, int flags) {
  return counted<decltype(send)>("send")(socket, data, size, flags);
}
int accept4(int socket, sockaddr* address, socklen_t* size, int flags) {
  return counted<decltype(accept4)>("accept4")(socket, address, size, flags);
}

}  // extern "C"
