#include "drivers/camera/socket_camera.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace walkman::camera {
namespace {

constexpr Time kHelloLimit = std::chrono::seconds(2);
constexpr Time kCloudLimit = std::chrono::seconds(30);
// What one call takes in while polling: a fraction of a millisecond's work.
constexpr std::size_t kMaxBytes = std::numeric_limits<std::size_t>::max();
constexpr std::size_t kBytesPerPoll = std::size_t{512} * 1024;

}  // namespace

SocketCamera::SocketCamera(std::string path, std::function<Time()> now)
    : path_(std::move(path)), now_(std::move(now)), buffer_(kHeaderBytes) {
  try {
    connect();
    while (!read_some()) {
      if (!wait_readable(kHelloLimit)) fail("no hello from the camera within 2 s");
    }
    if (header_.type != MessageType::kHello) fail("the camera did not begin with a hello");
    hello_ = decode_hello(payload());
    filled_ = 0;
    // Memory for clouds is taken and touched now, not in a control cycle.
    cloud_.points.assign(static_cast<std::size_t>(hello_.width) * hello_.height, Eigen::Vector3f::Zero());
    spare_ = cloud_.points;
    buffer_.assign(kHeaderBytes + kCloudFixedBytes + cloud_.points.size() * sizeof(Eigen::Vector3f), 0);
  } catch (...) {
    if (socket_ >= 0) close(socket_);
    throw;
  }
}

SocketCamera::~SocketCamera() { close(socket_); }

void SocketCamera::fail(const std::string& what) const { throw std::runtime_error(path_ + ": " + what); }

void SocketCamera::connect() {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path_.empty() || path_.size() >= sizeof address.sun_path) {
    fail("a camera socket's path has 1 to " + std::to_string(sizeof address.sun_path - 1) + " characters");
  }
  std::memcpy(address.sun_path, path_.c_str(), path_.size() + 1);
  socket_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (socket_ < 0) fail(std::string("no local socket (") + std::strerror(errno) + ")");
  if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    fail(std::string("no camera behind this socket (") + std::strerror(errno) +
         "), expected a running emulator");
  }
  // In a folder where everybody may write, somebody else may have been there first.
  ucred server{};
  socklen_t size = sizeof server;
  const bool known = getsockopt(socket_, SOL_SOCKET, SO_PEERCRED, &server, &size) == 0;
  if (!known || (server.uid != geteuid() && server.uid != 0 && geteuid() != 0)) {
    fail("served by another user, expected an emulator of this one's");
  }
}

bool SocketCamera::wait_readable(Time limit) const {
  pollfd wait{socket_, POLLIN, 0};
  const auto milliseconds = std::chrono::ceil<std::chrono::milliseconds>(limit).count();
  return poll(&wait, 1, static_cast<int>(milliseconds)) > 0;
}

std::size_t SocketCamera::message_bytes() const {
  return filled_ < kHeaderBytes ? kHeaderBytes : kHeaderBytes + header_.length;
}

std::span<const std::uint8_t> SocketCamera::payload() const {
  return std::span(buffer_).subspan(kHeaderBytes, header_.length);
}

bool SocketCamera::read_some() {
  std::size_t budget = waiting_ == Waiting::kPoll ? kBytesPerPoll : kMaxBytes;
  while (filled_ < message_bytes()) {
    if (budget == 0) return false;
    const std::size_t wanted = std::min(message_bytes() - filled_, budget);
    const ssize_t n = recv(socket_, buffer_.data() + filled_, wanted, MSG_DONTWAIT);
    if (n == 0) fail("the camera closed the connection");
    if (n < 0) {
      if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) return false;
      fail(std::string("connection to the camera lost (") + std::strerror(errno) + ")");
    }
    const bool in_header = filled_ < kHeaderBytes;
    filled_ += static_cast<std::size_t>(n);
    budget -= static_cast<std::size_t>(n);
    if (in_header && filled_ == kHeaderBytes) {
      try {
        header_ = read_header(std::span<const std::uint8_t, kHeaderBytes>(buffer_.data(), kHeaderBytes));
      } catch (const std::runtime_error& e) {
        fail(e.what());
      }
      if (buffer_.size() < message_bytes()) buffer_.resize(message_bytes());
    }
  }
  return true;
}

void SocketCamera::send_request(Time not_before) {
  asked_at_ = now_();
  const std::vector<std::uint8_t> request = encode_request(std::max(Time{}, asked_at_ - not_before));
  const ssize_t n = send(socket_, request.data(), request.size(), MSG_NOSIGNAL);
  if (n != static_cast<ssize_t>(request.size())) fail("connection to the camera lost");
  asked_ = true;
}

bool SocketCamera::latest(Time not_before, OrganizedCloud& out) {
  if (!asked_) send_request(not_before);
  while (!read_some()) {
    if (waiting_ == Waiting::kPoll) return false;
    if (!wait_readable(kCloudLimit)) fail("no answer from the camera within 30 s");
  }
  asked_ = false;
  filled_ = 0;
  Time camera_now;
  try {
    if (header_.type == MessageType::kNone) {
      (void)decode_none(payload());
      return false;
    }
    if (header_.type != MessageType::kCloud) throw std::runtime_error("a message out of turn");
    camera_now = decode_cloud(payload(), cloud_);
  } catch (const std::runtime_error& e) {
    fail(e.what());
  }
  // The camera looked at its clock when the request arrived, a little after `asked_at_`: never too young.
  cloud_.stamp = asked_at_ - (camera_now - cloud_.stamp);
  std::swap(out, cloud_);
  if (cloud_.points.capacity() < spare_.capacity()) std::swap(cloud_.points, spare_);
  return out.stamp >= not_before;
}

}  // namespace walkman::camera
