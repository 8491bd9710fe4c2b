#include "emulator/camera/cloud_server.h"

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "emulator/pacing/host_scheduling.h"

namespace walkman {
namespace {

constexpr std::size_t kMaxClients = 8;
constexpr int kSendLimitMs = 10'000;  // for a client that has stopped reading

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw std::runtime_error(path + ": " + what + " (" + std::strerror(errno) + ")");
}

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path) {
    throw std::runtime_error(path + ": a camera socket's path has 1 to " +
                             std::to_string(sizeof address.sun_path - 1) + " characters");
  }
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  return address;
}

/// A socket file whose server is gone.
bool is_abandoned(const sockaddr_un& address) {
  const int probe = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (probe < 0) return false;
  const bool refused = connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 &&
                       errno == ECONNREFUSED;
  close(probe);
  return refused;
}

}  // namespace

CloudServer::CloudServer(const Settings& settings, MultiSense& camera)
    : settings_(settings), camera_(camera) {
  listen();
  stop_ = eventfd(0, EFD_CLOEXEC);
  if (stop_ < 0) {
    close(listener_);
    unlink(settings_.path.c_str());
    fail(settings_.path, "no event descriptor");
  }
  thread_ = std::thread([this] { work(); });
}

CloudServer::~CloudServer() {
  const std::uint64_t one = 1;
  (void)!write(stop_, &one, sizeof one);
  thread_.join();
  for (const Client& client : clients_) close(client.socket);
  close(listener_);
  close(stop_);
  unlink(settings_.path.c_str());
}

void CloudServer::listen() {
  const sockaddr_un address = address_of(settings_.path);
  if (is_abandoned(address)) unlink(settings_.path.c_str());
  listener_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (listener_ < 0) fail(settings_.path, "no local socket");
  if (bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(listener_, static_cast<int>(kMaxClients)) != 0) {
    const int error = errno;
    close(listener_);
    errno = error;
    fail(settings_.path, error == EADDRINUSE ? "the camera's socket is in use by another program"
                                             : "the camera's socket cannot be made");
  }
}

void CloudServer::publish(Time now) {
  const std::lock_guard lock(mutex_);
  now_ = now;
  if (camera_.exposure().frame == published_frame_) return;
  published_frame_ = camera_.exposure().frame;
  exposure_ = camera_.exposure();
}

void CloudServer::work() {
  clock::stay_behind();  // the control loop goes first
  std::vector<pollfd> waits;
  while (true) {
    waits.assign({{stop_, POLLIN, 0}, {clients_.size() < kMaxClients ? listener_ : -1, POLLIN, 0}});
    for (const Client& client : clients_) waits.push_back({client.socket, POLLIN, 0});
    if (poll(waits.data(), waits.size(), -1) < 0 && errno != EINTR) return;
    if (waits[0].revents != 0) return;
    for (std::size_t i = clients_.size(); i-- > 0;) {
      if (waits[i + 2].revents == 0 || serve(clients_[i])) continue;
      close(clients_[i].socket);
      clients_.erase(clients_.begin() + static_cast<std::ptrdiff_t>(i));
    }
    if (waits[1].revents != 0) accept_client();
  }
}

void CloudServer::accept_client() {
  const int socket = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (socket < 0) return;
  camera::Hello hello;
  {
    const std::lock_guard lock(mutex_);
    hello.now = now_;
  }
  hello.period = settings_.period;
  hello.pacing = settings_.pacing;
  hello.width = static_cast<std::uint32_t>(camera_.width());
  hello.height = static_cast<std::uint32_t>(camera_.height());
  if (send_all(socket, encode(hello))) {
    clients_.push_back({socket, {}});
  } else {
    close(socket);
  }
}

/// Reads and answers what a client sent; false when it has gone or speaks something else.
bool CloudServer::serve(Client& client) {
  std::array<std::uint8_t, 256> bytes;
  const ssize_t n = recv(client.socket, bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (n < 0) return errno == EAGAIN || errno == EINTR;
  if (n == 0) return false;
  client.received.insert(client.received.end(), bytes.begin(), bytes.begin() + n);
  try {
    while (client.received.size() >= camera::kHeaderBytes) {
      const auto header = camera::read_header(
          std::span<const std::uint8_t, camera::kHeaderBytes>(client.received.data(), camera::kHeaderBytes));
      if (header.type != camera::MessageType::kRequest) return false;
      const std::size_t whole = camera::kHeaderBytes + header.length;
      if (client.received.size() < whole) return true;
      const Time age = camera::decode_request(
          std::span<const std::uint8_t>(client.received).subspan(camera::kHeaderBytes, header.length));
      client.received.erase(client.received.begin(),
                            client.received.begin() + static_cast<std::ptrdiff_t>(whole));
      if (!send_all(client.socket, answer(age))) return false;
    }
  } catch (const std::runtime_error&) {
    return false;  // not our protocol: the connection ends
  }
  return true;
}

std::vector<std::uint8_t> CloudServer::answer(Time age) {
  Time now{};
  Exposure exposure;
  {
    const std::lock_guard lock(mutex_);
    now = now_;
    exposure = exposure_;
  }
  if (exposure.stamp == Time::min() || now - exposure.stamp > age) return camera::encode_none(now);
  camera_.render(exposure, cloud_);
  ++served_;
  return camera::encode_cloud(now, cloud_);
}

bool CloudServer::send_all(int socket, const std::vector<std::uint8_t>& bytes) const {
  std::size_t sent = 0;
  while (sent < bytes.size()) {
    const ssize_t n = send(socket, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n > 0) {
      sent += static_cast<std::size_t>(n);
      continue;
    }
    if (n < 0 && errno != EAGAIN && errno != EINTR) return false;
    pollfd waits[] = {{socket, POLLOUT, 0}, {stop_, POLLIN, 0}};
    if (poll(waits, 2, kSendLimitMs) == 0 || waits[1].revents != 0) return false;
  }
  return true;
}

}  // namespace walkman
