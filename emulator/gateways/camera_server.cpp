#include "emulator/gateways/camera_server.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <linux/errqueue.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include "drivers/camera/multisense/udp_port.h"
#include "emulator/pacing/host.h"

namespace walkman::gateways {
namespace {

constexpr int kSilenceMs = 1000;
constexpr Time kLatestImu = std::chrono::milliseconds(50);
constexpr int kMostRequests = 64;  // taken before pending output is handed over

MultiSenseDevice::Address key_of(const sockaddr_in& address) {
  return std::uint64_t{ntohl(address.sin_addr.s_addr)} << 16U | ntohs(address.sin_port);
}

sockaddr_in address_of(MultiSenseDevice::Address key) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(static_cast<std::uint32_t>(key >> 16U));
  address.sin_port = htons(static_cast<std::uint16_t>(key));
  return address;
}

}  // namespace

CameraServer::CameraServer(const std::string& address, MultiSense& camera)
    : device_(camera, address.substr(0, address.find(':'))),
      camera_(camera),
      wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  const multisense::UdpAddress wanted = multisense::parse_udp_address(address);
  const sockaddr_in bound = address_of(std::uint64_t{wanted.host} << 16U | wanted.port);
  socket_ = Descriptor(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!socket_.valid() || !wake_.valid() ||
      bind(socket_.get(), reinterpret_cast<const sockaddr*>(&bound), sizeof bound) != 0) {
    throw std::runtime_error(fmt::format("the camera cannot be served at {}:{}: {}",
                                         address.substr(0, address.find(':')), wanted.port,
                                         std::strerror(errno)));
  }
  const int yes = 1;
  static_cast<void>(setsockopt(socket_.get(), IPPROTO_IP, IP_RECVERR, &yes, sizeof yes));
  outbox_.emplace(socket_.get(), [this] { wake(); });
  thread_ = std::thread([this] { work(); });
}

CameraServer::~CameraServer() {
  stop_ = true;
  wake();
  thread_.join();
}

void CameraServer::wake() {
  const std::uint64_t one = 1;
  static_cast<void>(!::write(wake_.get(), &one, sizeof one));
}

void CameraServer::publish(Time now) {
  bool is_new = false;
  {
    const std::lock_guard lock(mutex_);
    published_.now = now;
    is_new = camera_.exposure().frame != published_.exposure.frame;
    if (is_new) published_.exposure = camera_.exposure();
    const LaserTurns& turns = camera_.turns();
    for (const auto& turn : turns)
      if (turn->number > last_turn_) published_.turns.push_back(turn);
    while (published_.turns.size() > Laser::kKept) published_.turns.pop_front();
    is_new = is_new || (!turns.empty() && turns.back()->number > last_turn_);
    if (!turns.empty()) last_turn_ = turns.back()->number;
  }
  // The inertial unit's samples are sent along with other output; if there is none, without much delay.
  is_new = is_new || (camera_.imu() != nullptr && now - woken_ >= kLatestImu);
  if (!is_new || !device_.streams()) return;
  woken_ = now;
  wake();
}

void CameraServer::update() {
  {
    const std::lock_guard lock(mutex_);
    seen_.now = published_.now;
    if (seen_.exposure.frame != published_.exposure.frame) seen_.exposure = published_.exposure;
    seen_.turns.swap(published_.turns);
    published_.turns.clear();
  }
  try {
    device_.publish(seen_.now, seen_.exposure, seen_.turns);
  } catch (const std::exception&) {
    // The frame cannot be cast because the world's poses are no longer finite; the loop reports that.
  }
}

/// Forgets clients whose port is closed, which the kernel reports in a separate queue.
void CameraServer::forget_closed() {
  for (;;) {
    sockaddr_in to{};
    std::array<char, 512> control{};
    msghdr message{};
    message.msg_name = &to;
    message.msg_namelen = sizeof to;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    if (recvmsg(socket_.get(), &message, MSG_ERRQUEUE) < 0) return;
    // Others, of a network on the way, do not say that the client is gone.
    const cmsghdr* const header = CMSG_FIRSTHDR(&message);
    if (header == nullptr || header->cmsg_type != IP_RECVERR) continue;
    sock_extended_err error{};
    std::memcpy(&error, CMSG_DATA(header), sizeof error);
    if (error.ee_errno != ECONNREFUSED) continue;
    device_.forget(key_of(to));
    outbox_->drop(key_of(to));
  }
}

void CameraServer::work() {
  pacing::stay_behind();  // the control loop goes first
  while (true) {
    std::array<pollfd, 2> ready{{{socket_.get(), POLLIN, 0}, {wake_.get(), POLLIN, 0}}};
    static_cast<void>(poll(ready.data(), ready.size(), kSilenceMs));
    if (stop_) return;
    std::uint64_t wakes = 0;
    static_cast<void>(!::read(wake_.get(), &wakes, sizeof wakes));
    const Time wall = pacing::host_now();
    update();
    take_requests(wall);
    forget_closed();
    device_.stop_silent(wall);
    hand_over();
  }
}

void CameraServer::take_requests(Time wall) {
  for (int i = 0; i < kMostRequests; ++i) {
    sockaddr_in from{};
    socklen_t size = sizeof from;
    request_.resize(multisense::kMostDatagramBytes + 1);
    const ssize_t bytes = recvfrom(socket_.get(), request_.data(), request_.size(), 0,
                                   reinterpret_cast<sockaddr*>(&from), &size);
    if (bytes < 0) return;
    request_.resize(static_cast<std::size_t>(bytes));
    update();
    device_.receive(key_of(from), request_, wall);
  }
}

void CameraServer::hand_over() {
  MultiSenseDevice::Address to = 0;
  while (!outbox_->full() && device_.next(to, datagram_)) outbox_->push(to, datagram_);
}

}  // namespace walkman::gateways
