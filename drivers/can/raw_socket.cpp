#include "drivers/can/raw_socket.h"

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include <linux/can/error.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

namespace walkman::can {
namespace {

/// Closes a socket that could not be set up; preserves `errno`.
const char* give_up(int descriptor, const char* what) noexcept {
  const int error = errno;
  if (descriptor >= 0) close(descriptor);
  errno = error;
  return what;
}

}  // namespace

RawSocket::RawSocket(const std::string& interface_name, const SocketCanOptions& options)
    : name_(interface_name),
      errors_(options.error_frames ? CAN_ERR_MASK : CAN_ERR_CRTL | CAN_ERR_BUSOFF | CAN_ERR_RESTARTED),
      receive_buffer_(options.receive_buffer),
      stamps_(options.stamps) {
  if (name_.empty() || name_.size() >= IFNAMSIZ) {
    throw std::runtime_error("CAN interface \"" + name_ + "\": the name has " + std::to_string(name_.size()) +
                             " characters, expected 1 to " + std::to_string(IFNAMSIZ - 1));
  }
  if (options.listens) filters_.push_back({0, 0});
}

RawSocket::~RawSocket() {
  if (descriptor_ >= 0) close(descriptor_);
}

const char* RawSocket::set_up(int descriptor) const noexcept {
  const int on = 1;
  if (setsockopt(descriptor, SOL_CAN_RAW, CAN_RAW_FILTER, filters_.data(),
                 static_cast<socklen_t>(filters_.size() * sizeof(can_filter))) != 0 ||
      setsockopt(descriptor, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors_, sizeof errors_) != 0 ||
      setsockopt(descriptor, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on) != 0 ||
      (stamps_ && setsockopt(descriptor, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) != 0) ||
      setsockopt(descriptor, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on) != 0) {
    return "cannot set up the CAN socket";
  }
  // Only root may exceed rmem_max.
  if (setsockopt(descriptor, SOL_SOCKET, SO_RCVBUFFORCE, &receive_buffer_, sizeof(int)) != 0) {
    setsockopt(descriptor, SOL_SOCKET, SO_RCVBUF, &receive_buffer_, sizeof(int));
  }
  return nullptr;
}

const char* RawSocket::open() noexcept {
  const int descriptor = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (descriptor < 0) {
    const bool none = errno == EAFNOSUPPORT || errno == EPROTONOSUPPORT;
    return none ? "no such CAN interface, this kernel has no CAN sockets" : "cannot open a CAN socket";
  }
  const unsigned index = if_nametoindex(name_.c_str());
  if (index == 0) return give_up(descriptor, "no such CAN interface");
  if (const char* failed = set_up(descriptor)) return give_up(descriptor, failed);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(index);
  if (bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return give_up(descriptor, errno == ENODEV ? "is not a CAN interface" : "cannot bind the CAN socket");
  }
  if (descriptor_ >= 0) close(descriptor_);
  descriptor_ = descriptor;
  index_ = index;
  static_cast<void>(look());
  return nullptr;
}

RawSocket::Link RawSocket::look() noexcept {
  ifreq request{};
  std::memcpy(request.ifr_name, name_.c_str(), name_.size() + 1);
  if (ioctl(descriptor_, SIOCGIFINDEX, &request) != 0) return Link::kGone;
  // A different interface that has the name now is not the one this socket is bound to.
  if (static_cast<unsigned>(request.ifr_ifindex) != index_) return Link::kGone;
  if (ioctl(descriptor_, SIOCGIFMTU, &request) == 0)
    carries_fd_ = request.ifr_mtu >= static_cast<int>(CANFD_MTU);
  if (ioctl(descriptor_, SIOCGIFFLAGS, &request) != 0) return Link::kGone;
  return (request.ifr_flags & IFF_UP) != 0 ? Link::kUp : Link::kDown;
}

}  // namespace walkman::can
