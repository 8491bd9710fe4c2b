#include "emulator/gateways/cloud_server.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <limits>
#include <stdexcept>

#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include "emulator/pacing/host.h"

namespace walkman::gateways {
namespace {

constexpr std::size_t kRequestBytes = camera::kHeaderBytes + 8;

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw std::runtime_error(path + ": " + what);
}

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) {
    fail(path,
         "a camera socket's path has 1 to " + std::to_string(sizeof address.sun_path - 1) + " characters");
  }
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  return address;
}

/// Removes a socket of this user's whose server is gone. Throws when something else is in the way.
void clear_the_way(const std::string& path, const sockaddr_un& address) {
  struct stat there {};
  if (lstat(path.c_str(), &there) != 0) return;  // nothing there, or `bind` tells why
  if (!S_ISSOCK(there.st_mode)) {
    fail(path, "is there already and is not a camera's socket, expected a path of its own");
  }
  const Descriptor probe(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const int result = connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
  // A server whose queue is full does not refuse: it has no time (EAGAIN).
  if (result == 0 || errno != ECONNREFUSED) fail(path, "the camera's socket is in use by another program");
  if (there.st_uid != geteuid())
    fail(path, "a socket that another user has left, expected a path of its own");
  if (unlink(path.c_str()) != 0) {
    fail(path, std::string("the socket left behind cannot be removed (") + std::strerror(errno) + ")");
  }
}

}  // namespace

struct CloudServer::Client {
  Client(Descriptor s, Time wall) : socket(std::move(s)), active_at(wall) {}

  [[nodiscard]] bool is_answered() const noexcept { return sent == head.size() + body().size(); }
  [[nodiscard]] std::span<const std::byte> body() const noexcept {
    return cloud ? std::as_bytes(std::span(cloud->points)) : std::span<const std::byte>();
  }

  Descriptor socket;
  Time active_at;  // on the host's clock: connected, asked, or took some of an answer
  bool has_asked = false;
  bool gone = false;
  std::uint32_t watched = EPOLLIN;
  std::array<std::uint8_t, kRequestBytes> request{};
  std::size_t received = 0;
  // The answer on its way: a head, and a cloud's points behind it.
  std::vector<std::uint8_t> head;
  std::shared_ptr<const camera::OrganizedCloud> cloud;
  std::size_t sent = 0;
};

CloudServer::CloudServer(const std::string& path, MultiSense& camera)
    : camera_(camera), stop_(eventfd(0, EFD_CLOEXEC)), epoll_(epoll_create1(EPOLL_CLOEXEC)) {
  listen(path);
  epoll_event stopping{.events = EPOLLIN, .data = {.ptr = &stop_}};
  epoll_event listening{.events = EPOLLIN, .data = {.ptr = &listener_}};
  if (!stop_.valid() || !epoll_.valid() ||
      epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, stop_.get(), &stopping) != 0 ||
      epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, listener_.get(), &listening) != 0) {
    fail(path, std::string("the camera's socket cannot be waited for (") + std::strerror(errno) + ")");
  }
  thread_ = std::thread([this] { work(); });
}

CloudServer::~CloudServer() {
  const std::uint64_t one = 1;
  static_cast<void>(!::write(stop_.get(), &one, sizeof one));
  thread_.join();
}

void CloudServer::listen(const std::string& path) {
  const sockaddr_un address = address_of(path);
  const FolderLock lock(path);
  clear_the_way(path, address);
  listener_ = Descriptor(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  // The file gets the socket's own mode, so there is no moment in which others may connect.
  if (!listener_.valid() || fchmod(listener_.get(), S_IRUSR | S_IWUSR) != 0 ||
      bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    fail(path, std::string("the camera's socket cannot be made (") + std::strerror(errno) + ")");
  }
  file_ = OwnedPath(path);
  if (::listen(listener_.get(), SOMAXCONN) != 0) {
    fail(path, std::string("the camera's socket cannot be listened on (") + std::strerror(errno) + ")");
  }
}

void CloudServer::publish(Time now) {
  const std::lock_guard lock(mutex_);
  published_.now = now;
  if (camera_.exposure().frame != published_.exposure.frame) published_.exposure = camera_.exposure();
}

void CloudServer::work() {
  pacing::stay_behind();  // the control loop goes first
  std::array<epoll_event, kMaxClients + 2> events;
  while (true) {
    const int ready =
        epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), wait_ms(pacing::host_now()));
    if (ready < 0 && errno != EINTR) return;
    const Time wall = pacing::host_now();
    bool called = false;
    for (int i = 0; i < ready; ++i) {
      const epoll_event& event = events[static_cast<std::size_t>(i)];
      if (event.data.ptr == &stop_) return;
      if (event.data.ptr == &listener_) {
        called = true;
        continue;
      }
      Client& client = *static_cast<Client*>(event.data.ptr);
      if ((event.events & EPOLLIN) != 0) read(client, wall);
      if ((event.events & EPOLLOUT) != 0) write(client, wall);
      if ((event.events & (EPOLLERR | EPOLLHUP)) != 0) client.gone = true;
    }
    for (const auto& client : clients_) {
      if (!client->is_answered() && wall - client->active_at > kSendLimit) client->gone = true;
    }
    std::erase_if(clients_, [](const auto& client) { return client->gone; });
    if (called) accept_clients(wall);
  }
}

/// How long to wait for clients before one has to be given up; -1: for ever.
int CloudServer::wait_ms(Time wall) const {
  Time next = Time::max();
  for (const auto& client : clients_) {
    if (!client->is_answered()) next = std::min(next, client->active_at + kSendLimit);
  }
  if (next == Time::max()) return -1;
  return static_cast<int>(
             std::chrono::ceil<std::chrono::milliseconds>(std::max(Time{}, next - wall)).count()) +
         1;
}

void CloudServer::accept_clients(Time wall) {
  for (;;) {
    Descriptor socket(accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (!socket.valid()) return;
    if (clients_.size() == kMaxClients) make_room();
    auto client = std::make_unique<Client>(std::move(socket), wall);
    camera::Hello hello;
    {
      const std::lock_guard lock(mutex_);
      hello.now = published_.now;
    }
    hello.width = static_cast<std::uint32_t>(camera_.width());
    hello.height = static_cast<std::uint32_t>(camera_.height());
    client->head = encode(hello);
    epoll_event event{.events = client->watched, .data = {.ptr = client.get()}};
    if (epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, client->socket.get(), &event) != 0) continue;
    write(*client, wall);
    if (!client->gone) clients_.push_back(std::move(client));
  }
}

void CloudServer::make_room() {
  clients_.erase(std::min_element(clients_.begin(), clients_.end(), [](const auto& a, const auto& b) {
    return std::pair(a->has_asked, a->active_at) < std::pair(b->has_asked, b->active_at);
  }));
}

void CloudServer::read(Client& client, Time wall) {
  if (!client.is_answered()) return;
  std::uint8_t* const free = client.request.data() + client.received;
  const ssize_t size = recv(client.socket.get(), free, client.request.size() - client.received, 0);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
  client.gone = size <= 0;
  if (client.gone) return;
  client.received += static_cast<std::size_t>(size);
  try {
    if (client.received < camera::kHeaderBytes) return;
    const std::span<const std::uint8_t, kRequestBytes> request(client.request);
    const camera::MessageHeader header = camera::read_header(request.first<camera::kHeaderBytes>());
    client.gone = header.type != camera::MessageType::kRequest;
    if (client.gone || client.received < kRequestBytes) return;
    client.received = 0;
    client.has_asked = true;
    client.active_at = wall;
    answer(client, camera::decode_request(request.last<kRequestBytes - camera::kHeaderBytes>()));
    write(client, wall);
  } catch (const std::runtime_error&) {
    client.gone = true;  // not our protocol
  }
}

void CloudServer::answer(Client& client, Time age) {
  Published published;
  {
    const std::lock_guard lock(mutex_);
    published = published_;
  }
  client.sent = 0;
  const Exposure& exposure = published.exposure;
  if (exposure.stamp == Time::min() || published.now - exposure.stamp > age) {
    client.head = camera::encode_none(published.now);
    return;
  }
  if (!cloud_ || cloud_->frame != exposure.frame) {
    if (!cloud_ || cloud_.use_count() > 1) cloud_ = std::make_shared<camera::OrganizedCloud>();
    camera_.render(exposure, *cloud_);
  }
  client.head = camera::encode_cloud_head(published.now, *cloud_);
  client.cloud = cloud_;
  ++served_;
}

void CloudServer::write(Client& client, Time wall) {
  while (!client.is_answered()) {
    const bool in_head = client.sent < client.head.size();
    const std::span<const std::byte> part = in_head
                                                ? std::as_bytes(std::span(client.head)).subspan(client.sent)
                                                : client.body().subspan(client.sent - client.head.size());
    const ssize_t size = ::send(client.socket.get(), part.data(), part.size(), MSG_NOSIGNAL);
    if (size > 0) {
      client.sent += static_cast<std::size_t>(size);
      client.active_at = wall;
    } else if (errno != EINTR) {
      if (errno != EAGAIN && errno != EWOULDBLOCK) client.gone = true;
      break;
    }
  }
  if (client.is_answered()) {
    client.head.clear();
    client.cloud.reset();
    client.sent = 0;
  }
  watch(client);
}

void CloudServer::watch(Client& client) {
  const std::uint32_t wanted = client.is_answered() ? EPOLLIN : EPOLLOUT;
  if (wanted == client.watched || client.gone) return;
  client.watched = wanted;
  epoll_event event{.events = wanted, .data = {.ptr = &client}};
  if (epoll_ctl(epoll_.get(), EPOLL_CTL_MOD, client.socket.get(), &event) != 0) client.gone = true;
}

}  // namespace walkman::gateways
