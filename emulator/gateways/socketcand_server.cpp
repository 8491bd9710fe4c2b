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

namespace walkman::gateways {

namespace {

constexpr std::size_t kReadSize = 4096;
constexpr int kReadsAtOnce = 4;           // of one client in one call of `service`
constexpr int kKernelQueue = 256 * 1024;  // bounds how stale a slow client's frames become

Time host_time() noexcept { return std::chrono::steady_clock::now().time_since_epoch(); }

[[noreturn]] void fail(const SocketcandOptions& options, const char* reason) {
  throw std::runtime_error("socketcand server on " + options.address + " port " +
                           std::to_string(options.port) + ": " + reason);
}

Descriptor listen_on(const SocketcandOptions& options, std::uint16_t& port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(options.port);
  if (inet_pton(AF_INET, options.address.c_str(), &address.sin_addr) != 1) {
    fail(options, "not an IPv4 address; expected for example 127.0.0.1");
  }
  Descriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket.valid()) fail(options, std::strerror(errno));
  const int on = 1;
  setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  socklen_t length = sizeof address;
  auto* const generic = reinterpret_cast<sockaddr*>(&address);
  if (bind(socket.get(), generic, length) != 0 || listen(socket.get(), 16) != 0 ||
      getsockname(socket.get(), generic, &length) != 0) {
    fail(options, std::strerror(errno));
  }
  port = ntohs(address.sin_port);
  return socket;
}

}  // namespace

struct SocketcandServer::Client {
  Client(Descriptor s, EndPool& pool, SocketcandCounters& counters)
      : socket(std::move(s)), session(pool, counters) {}

  Descriptor socket;
  SocketcandSession session;
  std::array<char, kReadSize> buffer;
  std::string_view input;  // of the buffer, what the session has not taken yet
  std::uint32_t watched = EPOLLIN;
  bool blocked = false;
  bool gone = false;
};

SocketcandServer::SocketcandServer(std::span<bus::CanBus* const> buses, const SocketcandOptions& options)
    : pool_(buses),
      listener_(listen_on(options, port_)),
      timer_(timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC)),
      epoll_(epoll_create1(EPOLL_CLOEXEC)) {
  clients_.reserve(kMaxClients);
  // Edge-triggered: a client that cannot be accepted for want of descriptors does not keep waking the owner.
  epoll_event listening{.events = EPOLLIN | EPOLLET, .data = {.ptr = nullptr}};
  epoll_event timing{.events = EPOLLIN, .data = {.ptr = nullptr}};
  if (!timer_.valid() || !epoll_.valid() ||
      epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, listener_.get(), &listening) != 0 ||
      epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, timer_.get(), &timing) != 0) {
    fail(options, std::strerror(errno));
  }
}

SocketcandServer::~SocketcandServer() = default;

void SocketcandServer::service() noexcept {
  std::array<epoll_event, kMaxClients + 2> events;
  const int ready = epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), 0);
  for (int i = 0; i < ready; ++i) {
    auto* const client = static_cast<Client*>(events[static_cast<std::size_t>(i)].data.ptr);
    if (client != nullptr && (events[static_cast<std::size_t>(i)].events & (EPOLLERR | EPOLLHUP)) != 0) {
      client->gone = true;
    }
  }
  std::uint64_t expirations = 0;
  static_cast<void>(::read(timer_.get(), &expirations, sizeof expirations));
  accept_clients();
  const Time wall = host_time();
  for (const auto& client : clients_) {
    if (!client->gone) read(*client, wall);
  }
  for (const auto& client : clients_) {
    client->session.forward(wall);
    write(*client);
    if (!client->gone) watch(*client);
  }
  std::erase_if(clients_, [](const auto& client) { return client->gone; });
  set_timer();
}

void SocketcandServer::accept_clients() noexcept {
  for (;;) {
    Descriptor socket(accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (!socket.valid()) {
      if (errno == EINTR || errno == ECONNABORTED) continue;
      return;
    }
    const int on = 1;
    // Replies of the handshake must not wait to be sent together.
    setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    setsockopt(socket.get(), SOL_SOCKET, SO_SNDBUF, &kKernelQueue, sizeof kKernelQueue);
    if (clients_.size() == kMaxClients) {
      constexpr std::string_view kFull = "< error too many clients >";
      static_cast<void>(::send(socket.get(), kFull.data(), kFull.size(), MSG_NOSIGNAL));
      continue;
    }
    auto client = std::make_unique<Client>(std::move(socket), pool_, counters_);
    epoll_event event{.events = client->watched, .data = {.ptr = client.get()}};
    if (epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, client->socket.get(), &event) != 0) continue;
    write(*client);
    clients_.push_back(std::move(client));
  }
}

void SocketcandServer::read(Client& client, Time wall) noexcept {
  for (int reads = 0; reads < kReadsAtOnce;) {
    const SocketcandSession::Step step = client.session.step(client.input, wall);
    // Every reply is sent on its own: clients compare what one read returns with the reply they expect.
    write(client);
    client.blocked = step == SocketcandSession::Step::kBlocked;
    if (step == SocketcandSession::Step::kClosed) client.gone = true;
    if (client.gone || client.blocked) return;
    if (step != SocketcandSession::Step::kNeedMore) continue;

    const ssize_t size = ::recv(client.socket.get(), client.buffer.data(), client.buffer.size(), 0);
    if (size < 0 && errno == EINTR) continue;
    if (size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
    if (size <= 0) {
      client.gone = true;
      return;
    }
    client.input = {client.buffer.data(), static_cast<std::size_t>(size)};
    ++reads;
  }
}

void SocketcandServer::write(Client& client) noexcept {
  TextQueue& outgoing = client.session.outgoing();
  while (!outgoing.empty()) {
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
  if (wanted == client.watched) return;
  client.watched = wanted;
  epoll_event event{.events = wanted, .data = {.ptr = &client}};
  if (epoll_ctl(epoll_.get(), EPOLL_CTL_MOD, client.socket.get(), &event) != 0) client.gone = true;
}

void SocketcandServer::set_timer() noexcept {
  Time next = Time::max();
  for (const auto& client : clients_) {
    if (client->session.held_until() != Time::min()) next = std::min(next, client->session.held_until());
  }
  itimerspec setting{};  // all zero: off
  if (next != Time::max()) {
    setting.it_value.tv_sec = next / std::chrono::seconds(1);
    setting.it_value.tv_nsec = (next % std::chrono::seconds(1)).count();
  }
  timerfd_settime(timer_.get(), TFD_TIMER_ABSTIME, &setting, nullptr);
}

}  // namespace walkman::gateways
