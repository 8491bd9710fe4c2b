#include "tests/bench/vcan/bus_socket.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include <fmt/format.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

namespace walkman::bench {
namespace {

constexpr timeval kPatience{1, 0};
constexpr int kReceiveBuffer = 8 << 20;

}  // namespace

can_frame frame_of(std::uint32_t can_id, std::initializer_list<int> bytes) {
  can_frame frame{};
  frame.can_id = can_id;
  frame.len = static_cast<std::uint8_t>(bytes.size());
  std::transform(bytes.begin(), bytes.end(), frame.data,
                 [](int byte) { return static_cast<std::uint8_t>(byte); });
  return frame;
}

BusSocket::BusSocket(const std::string& interface) : socket_(::socket(PF_CAN, SOCK_RAW, CAN_RAW)) {
  if (socket_ < 0) {
    throw std::runtime_error(
        fmt::format("this kernel has no CAN sockets ({}); run by vcan-setup/guest", std::strerror(errno)));
  }
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
  // Lets root exceed the limit of rmem_max; without it, a burst of a limb bus still fits the default.
  static_cast<void>(setsockopt(socket_, SOL_SOCKET, SO_RCVBUFFORCE, &kReceiveBuffer, sizeof(kReceiveBuffer)));
  setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof(kPatience));
  if (address.can_ifindex == 0 ||
      bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    const int error = errno;
    close(socket_);
    throw std::runtime_error(fmt::format("interface {}: {}", interface, std::strerror(error)));
  }
}

BusSocket::~BusSocket() { close(socket_); }

void BusSocket::send(const can_frame& frame) {
  if (write(socket_, &frame, sizeof(frame)) != sizeof(frame)) {
    throw std::runtime_error(fmt::format("sending {:03X}h: {}", frame.can_id, std::strerror(errno)));
  }
}

void BusSocket::send(const can_frame* frames, unsigned count) {
  std::array<mmsghdr, kBatch> messages{};
  std::array<iovec, kBatch> parts{};
  for (unsigned at = 0; at < count; ++at) {
    parts[at] = {const_cast<can_frame*>(frames + at), sizeof(can_frame)};
    messages[at].msg_hdr.msg_iov = &parts[at];
    messages[at].msg_hdr.msg_iovlen = 1;
  }
  if (sendmmsg(socket_, messages.data(), count, 0) != static_cast<int>(count)) {
    throw std::runtime_error(fmt::format("sending {} frames: {}", count, std::strerror(errno)));
  }
}

unsigned BusSocket::receive(bool wait) {
  std::array<mmsghdr, kBatch> messages{};
  std::array<iovec, kBatch> parts{};
  for (unsigned at = 0; at < kBatch; ++at) {
    parts[at] = {&frames_[at], sizeof(can_frame)};
    messages[at].msg_hdr.msg_iov = &parts[at];
    messages[at].msg_hdr.msg_iovlen = 1;
  }
  const int count = recvmmsg(socket_, messages.data(), kBatch, wait ? MSG_WAITFORONE : MSG_DONTWAIT, nullptr);
  return count > 0 ? static_cast<unsigned>(count) : 0;
}

void BusSocket::receive_until(const std::function<bool(const can_frame&)>& wanted) {
  const auto ends = SteadyClock::now() + std::chrono::seconds(1);
  bool done = false;
  while (!done) {
    const unsigned count = receive(true);
    for (unsigned at = 0; at < count; ++at) done = wanted(frames_[at]) || done;
    if (!done && SteadyClock::now() > ends) throw std::runtime_error("no answer within a second");
  }
}

void BusSocket::drain() {
  while (receive(false) > 0) {
  }
}

}  // namespace walkman::bench
