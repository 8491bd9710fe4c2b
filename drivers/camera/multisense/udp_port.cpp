#include "drivers/camera/multisense/udp_port.h"

#include <cerrno>
#include <charconv>
#include <cstring>
#include <stdexcept>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace walkman::multisense {
namespace {

// The size the vendor's client requests; the kernel grants as much of it as net.core.rmem_max allows.
constexpr int kReceiveBuffer = 48 << 20;

}  // namespace

UdpAddress parse_udp_address(const std::string& text) {
  const auto refuse = [&] {
    return std::runtime_error(fmt::format(
        "camera address \"{}\", expected an IPv4 address such as 127.0.0.1, or with a port 127.0.0.1:{}",
        text, kCommandPort));
  };
  const std::size_t colon = text.find(':');
  UdpAddress out{0, kCommandPort};
  in_addr host{};
  if (inet_pton(AF_INET, text.substr(0, colon).c_str(), &host) != 1) throw refuse();
  out.host = ntohl(host.s_addr);
  if (colon == std::string::npos) return out;
  const char *const begin = text.data() + colon + 1, *const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(begin, end, out.port);
  if (error != std::errc{} || rest != end || out.port == 0) throw refuse();
  return out;
}

UdpPort::UdpPort(const std::string& address) {
  const UdpAddress device = parse_udp_address(address);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(device.host);
  to.sin_port = htons(device.port);
  socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket_ < 0 || connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    const int error = errno;
    if (socket_ >= 0) close(socket_);
    throw std::runtime_error(
        fmt::format("the camera at {} cannot be reached: {}", address, std::strerror(error)));
  }
  static_cast<void>(setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &kReceiveBuffer, sizeof kReceiveBuffer));
}

UdpPort::~UdpPort() { close(socket_); }

void UdpPort::send(std::span<const std::uint8_t> datagram) {
  static_cast<void>(!::send(socket_, datagram.data(), datagram.size(), 0));
}

bool UdpPort::receive(std::vector<std::uint8_t>& datagram) {
  datagram.resize(kMostDatagramBytes + 1);  // one extra byte reveals datagrams that are too long
  // A port without a listener is reported once, on the next call.
  ssize_t size = recv(socket_, datagram.data(), datagram.size(), 0);
  if (size < 0 && errno == ECONNREFUSED) size = recv(socket_, datagram.data(), datagram.size(), 0);
  datagram.resize(static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  return size >= 0;
}

bool UdpPort::wait(Time limit) {
  pollfd readable{.fd = socket_, .events = POLLIN, .revents = 0};
  const auto milliseconds = std::chrono::ceil<std::chrono::milliseconds>(std::max(limit, Time{}));
  return poll(&readable, 1, static_cast<int>(milliseconds.count())) > 0;
}

}  // namespace walkman::multisense
