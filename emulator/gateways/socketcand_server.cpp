#include "emulator/gateways/socketcand_server.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/timerfd.h>

#include "emulator/pacing/host.h"

namespace walkman::gateways {

namespace {

constexpr const char* kAddress = "127.0.0.1";
constexpr const char* kBroadcastAddress = "127.255.255.255";
constexpr Time kBeaconPeriod = std::chrono::seconds(3);
constexpr std::size_t kReadSize = 4096;
constexpr int kReadsAtOnce = 4;           // of one client in one call of `service`
constexpr int kKernelQueue = 256 * 1024;  // bounds how stale a slow client's frames become

[[noreturn]] void fail(std::uint16_t port, const char* reason) {
  throw std::runtime_error(std::string("socketcand server on ") + kAddress + " port " + std::to_string(port) +
                           ": " + reason);
}

sockaddr_in address_of(const char* host, std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  inet_pton(AF_INET, host, &address.sin_addr);
  return address;
}

Descriptor listen_on(std::uint16_t wanted, std::uint16_t& port) {
  sockaddr_in address = address_of(kAddress, wanted);
  Descriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket.valid()) fail(wanted, std::strerror(errno));
  const int on = 1;
  setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  socklen_t length = sizeof address;
  auto* const generic = reinterpret_cast<sockaddr*>(&address);
  if (bind(socket.get(), generic, length) != 0 || listen(socket.get(), 16) != 0 ||
      getsockname(socket.get(), generic, &length) != 0) {
    fail(wanted, std::strerror(errno));
  }
  port = ntohs(address.sin_port);
  return socket;
}

Descriptor beacon_socket() {
  Descriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int on = 1;
  if (socket.valid()) setsockopt(socket.get(), SOL_SOCKET, SO_BROADCAST, &on, sizeof on);
  return socket;
}

}  // namespace

struct SocketcandServer::Client {
  Client(Descriptor s, ControllerPool& pool, SocketcandCounters& counters, Time wall)
      : socket(std::move(s)), session(pool, counters, wall) {}

  Descriptor socket;
  SocketcandSession session;
  std::array<char, kReadSize> buffer;
  std::string_view input;  // part of the buffer that the session has not taken yet
  std::uint32_t watched = EPOLLIN;
  bool blocked = false;
  bool gone = false;
};

SocketcandServer::SocketcandServer(std::span<bus::CanBus* const> buses, const SocketcandOptions& options)
    : pool_(buses),
      listener_(listen_on(options.port, port_)),
      timer_(timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC)),
      epoll_(epoll_create1(EPOLL_CLOEXEC)),
      beacon_port_(options.beacon_port) {
  clients_.reserve(kMaxClients);
  // Edge-triggered: a client that cannot be accepted for lack of descriptors does not keep waking the owner.
  epoll_event listening{.events = EPOLLIN | EPOLLET, .data = {.ptr = &listener_}};
  epoll_event timing{.events = EPOLLIN, .data = {.ptr = &timer_}};
  if (!timer_.valid() || !epoll_.valid() ||
      epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, listener_.get(), &listening) != 0 ||
      epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, timer_.get(), &timing) != 0) {
    fail(port_, std::strerror(errno));
  }
  if (!options.beacon) return;
  beacon_ = beacon_socket();
  if (!beacon_.valid()) fail(port_, std::strerror(errno));
  beacon_at_ = pacing::host_now();
  finish_round(beacon_at_);
}

SocketcandServer::~SocketcandServer() = default;

std::string SocketcandServer::address() const { return std::string(kAddress) + ":" + std::to_string(port_); }

void SocketcandServer::service() noexcept {
  std::array<epoll_event, kMaxClients + 2> events;
  const int ready = epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), 0);
  const Time wall = pacing::host_now();
  bool called = false;
  for (int i = 0; i < ready; ++i) {
    const epoll_event& event = events[static_cast<std::size_t>(i)];
    if (event.data.ptr == &listener_) {
      called = true;
    } else if (event.data.ptr == &timer_) {
      std::uint64_t expirations = 0;
      static_cast<void>(::read(timer_.get(), &expirations, sizeof expirations));
      timer_at_ = Time::max();
    } else {
      Client& client = *static_cast<Client*>(event.data.ptr);
      if ((event.events & (EPOLLERR | EPOLLHUP)) != 0) client.gone = true;
      if ((event.events & EPOLLIN) != 0 && !client.gone) read(client, wall);
    }
  }
  if (called) accept_clients(wall);
  for (const auto& client : clients_) serve(*client, wall);
  finish_round(wall);
}

void SocketcandServer::forward() noexcept {
  if (clients_.empty()) return;
  const Time wall = pacing::host_now();
  for (const auto& client : clients_) {
    if (client->blocked) work_off(*client, wall);
    serve(*client, wall);
  }
  finish_round(wall);
}

void SocketcandServer::accept_clients(Time wall) noexcept {
  for (;;) {
    Descriptor socket(accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (!socket.valid()) {
      if (errno == EINTR || errno == ECONNABORTED) continue;
      return;
    }
    const int on = 1;
    // Replies of the handshake must not be delayed to be sent together.
    setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    setsockopt(socket.get(), SOL_SOCKET, SO_SNDBUF, &kKernelQueue, sizeof kKernelQueue);
    if (clients_.size() == kMaxClients) {
      constexpr std::string_view kFull = "< error too many clients >";
      static_cast<void>(::send(socket.get(), kFull.data(), kFull.size(), MSG_NOSIGNAL));
      continue;
    }
    auto client = std::make_unique<Client>(std::move(socket), pool_, counters_, wall);
    epoll_event event{.events = client->watched, .data = {.ptr = client.get()}};
    if (epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, client->socket.get(), &event) != 0) continue;
    write(*client);
    clients_.push_back(std::move(client));
  }
}

void SocketcandServer::read(Client& client, Time wall) noexcept {
  for (int reads = 0; reads < kReadsAtOnce && !client.blocked && !client.gone;) {
    const ssize_t size = ::recv(client.socket.get(), client.buffer.data(), client.buffer.size(), 0);
    if (size < 0 && errno == EINTR) continue;
    if (size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
    if (size <= 0) {
      client.gone = true;
      return;
    }
    // A client that joins small messages (Nagle's algorithm) waits for this; delayed, it comes 40 ms later.
    constexpr int kOn = 1;
    setsockopt(client.socket.get(), IPPROTO_TCP, TCP_QUICKACK, &kOn, sizeof kOn);
    client.input = {client.buffer.data(), static_cast<std::size_t>(size)};
    ++reads;
    work_off(client, wall);
  }
}

/// Lets the session take what has been read, until it stops.
void SocketcandServer::work_off(Client& client, Time wall) noexcept {
  using Step = SocketcandSession::Step;
  Step step = Step::kDone;
  while (step == Step::kDone && !client.gone) {
    step = client.session.step(client.input, wall);
    // Every reply is sent on its own: clients compare what one read returns with the reply they expect.
    write(client);
  }
  client.blocked = step == Step::kBlocked;
  if (step == Step::kClosed) client.gone = true;
}

void SocketcandServer::serve(Client& client, Time wall) noexcept {
  if (wall >= client.session.open_until()) client.gone = true;
  if (client.gone) return;
  client.session.forward(wall);
  write(client);
  watch(client);
}

void SocketcandServer::write(Client& client) noexcept {
  TextQueue& outgoing = client.session.outgoing();
  while (!outgoing.empty() && !client.gone) {
    const std::string_view text = outgoing.text();
    const ssize_t size = ::send(client.socket.get(), text.data(), text.size(), MSG_NOSIGNAL);
    if (size > 0) {
      outgoing.pop(static_cast<std::size_t>(size));
    } else if (errno != EINTR) {
      if (errno != EAGAIN && errno != EWOULDBLOCK) client.gone = true;
      return;
    }
  }
}

void SocketcandServer::watch(Client& client) noexcept {
  std::uint32_t wanted = 0;
  if (!client.blocked) wanted |= EPOLLIN;
  if (!client.session.outgoing().empty()) wanted |= EPOLLOUT;
  if (wanted == client.watched || client.gone) return;
  client.watched = wanted;
  epoll_event event{.events = wanted, .data = {.ptr = &client}};
  if (epoll_ctl(epoll_.get(), EPOLL_CTL_MOD, client.socket.get(), &event) != 0) client.gone = true;
}

void SocketcandServer::finish_round(Time wall) noexcept {
  std::erase_if(clients_, [](const auto& client) { return client->gone; });
  if (wall >= beacon_at_) {
    send_beacon();
    beacon_at_ = wall + kBeaconPeriod;
  }
  Time next = beacon_at_;
  for (const auto& client : clients_) {
    next = std::min(next, client->session.open_until());
    if (client->session.held_until() != Time::min()) next = std::min(next, client->session.held_until());
  }
  if (next == timer_at_) return;
  timer_at_ = next;
  itimerspec setting{};  // all zero: off
  if (next != Time::max()) {
    setting.it_value.tv_sec = next / std::chrono::seconds(1);
    setting.it_value.tv_nsec = (next % std::chrono::seconds(1)).count();
  }
  timerfd_settime(timer_.get(), TFD_TIMER_ABSTIME, &setting, nullptr);
}

std::string SocketcandServer::beacon_text() const {
  std::array<char, 64> host{};
  static_cast<void>(gethostname(host.data(), host.size() - 1));
  std::string text = std::string("<CANBeacon name=\"") + host.data() +
                     "\" type=\"adapter\" description=\"walkman-hil, emulated buses\">\n<URL>can://" +
                     address() + "</URL>";
  for (const bus::CanBus* bus : pool_.buses())
    text.append("<Bus name=\"").append(bus->interface_name()).append("\"/>");
  return text + "</CANBeacon>";
}

void SocketcandServer::send_beacon() noexcept {
  const std::string text = beacon_text();
  const sockaddr_in to = address_of(kBroadcastAddress, beacon_port_);
  static_cast<void>(::sendto(beacon_.get(), text.data(), text.size(), 0,
                             reinterpret_cast<const sockaddr*>(&to), sizeof to));
}

}  // namespace walkman::gateways
