#include "drivers/camera/cloud_message.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

#include <unistd.h>

#include "drivers/canopen/little_endian.h"

namespace walkman::camera {
namespace {

constexpr std::array<std::uint8_t, 4> kMagic = {'W', 'M', 'C', 'L'};
constexpr std::uint16_t kVersion = 2;
constexpr std::size_t kHelloBytes = 8 + 4 + 4;
constexpr std::size_t kPointBytes = 12;
constexpr std::size_t kMaxCloudBytes = kCloudFixedBytes + kPointBytes * kMaxSide * kMaxSide;
static_assert(sizeof(Eigen::Vector3f) == kPointBytes);

[[noreturn]] void fail(const std::string& what) { throw std::runtime_error("camera socket: " + what); }

/// Writes one message, growing a buffer.
class Writer {
 public:
  Writer(MessageType type, std::size_t payload) : Writer(type, payload, payload) {}
  /// Only the first `here` bytes of the payload are written here.
  Writer(MessageType type, std::size_t payload, std::size_t here) {
    bytes_.reserve(kHeaderBytes + here);
    bytes_.assign(kMagic.begin(), kMagic.end());
    add(kVersion);
    add(static_cast<std::uint16_t>(type));
    add(static_cast<std::uint32_t>(payload));
  }
  template <typename T>
  void add(T value) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    canopen::put(bytes_.data() + at, value);
  }
  void add(Time time) { add(static_cast<std::int64_t>(time.count())); }
  [[nodiscard]] std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  std::vector<std::uint8_t> bytes_;
};

template <typename T>
T take(std::span<const std::uint8_t>& rest) {
  const T value = canopen::get<T>(rest.data());
  rest = rest.subspan(sizeof(T));
  return value;
}

Time take_time(std::span<const std::uint8_t>& rest) { return Time(take<std::int64_t>(rest)); }

void require_length(std::span<const std::uint8_t> payload, std::size_t expected, const char* name) {
  if (payload.size() == expected) return;
  fail(std::string(name) + " of " + std::to_string(payload.size()) + " bytes, expected " +
       std::to_string(expected));
}

void require_side(std::uint32_t value, const char* name) {
  if (value >= 1 && value <= kMaxSide) return;
  fail(std::string(name) + " of " + std::to_string(value) + " pixels, expected 1 to " +
       std::to_string(kMaxSide));
}

}  // namespace

MessageHeader read_header(std::span<const std::uint8_t, kHeaderBytes> bytes) {
  if (!std::equal(kMagic.begin(), kMagic.end(), bytes.begin())) {
    fail("the other end does not speak this protocol, expected a message that begins with \"WMCL\"");
  }
  const auto version = canopen::get<std::uint16_t>(bytes.data() + 4);
  if (version != kVersion) {
    fail("version " + std::to_string(version) + ", expected " + std::to_string(kVersion));
  }
  const auto type = canopen::get<std::uint16_t>(bytes.data() + 6);
  const auto length = canopen::get<std::uint32_t>(bytes.data() + 8);
  std::size_t least = 0, most = 0;
  switch (static_cast<MessageType>(type)) {
    case MessageType::kHello:
      least = most = kHelloBytes;
      break;
    case MessageType::kRequest:
    case MessageType::kNone:
      least = most = 8;
      break;
    case MessageType::kCloud:
      least = kCloudFixedBytes + kPointBytes;
      most = kMaxCloudBytes;
      break;
    default:
      fail("message type " + std::to_string(type) + ", expected 1 to 4");
  }
  if (length < least || length > most) {
    fail("message of type " + std::to_string(type) + " with " + std::to_string(length) + " bytes, expected " +
         std::to_string(least) + (least == most ? "" : " to " + std::to_string(most)));
  }
  return {static_cast<MessageType>(type), length};
}

std::vector<std::uint8_t> encode(const Hello& hello) {
  Writer writer(MessageType::kHello, kHelloBytes);
  writer.add(hello.now);
  writer.add(hello.width);
  writer.add(hello.height);
  return writer.take();
}

std::vector<std::uint8_t> encode_request(Time age) {
  Writer writer(MessageType::kRequest, 8);
  writer.add(age);
  return writer.take();
}

std::vector<std::uint8_t> encode_none(Time now) {
  Writer writer(MessageType::kNone, 8);
  writer.add(now);
  return writer.take();
}

std::vector<std::uint8_t> encode_cloud_head(Time now, const OrganizedCloud& cloud) {
  const std::size_t bytes = kPointBytes * cloud.points.size();
  Writer writer(MessageType::kCloud, kCloudFixedBytes + bytes, kCloudFixedBytes);
  writer.add(now);
  writer.add(cloud.stamp);
  writer.add(static_cast<std::uint64_t>(cloud.frame));
  writer.add(static_cast<std::uint32_t>(cloud.width));
  writer.add(static_cast<std::uint32_t>(cloud.height));
  return writer.take();
}

Hello decode_hello(std::span<const std::uint8_t> payload) {
  require_length(payload, kHelloBytes, "hello");
  Hello hello;
  hello.now = take_time(payload);
  hello.width = take<std::uint32_t>(payload);
  hello.height = take<std::uint32_t>(payload);
  require_side(hello.width, "width");
  require_side(hello.height, "height");
  return hello;
}

Time decode_request(std::span<const std::uint8_t> payload) {
  require_length(payload, 8, "request");
  const Time age = take_time(payload);
  if (age < Time{}) fail("request for a cloud of the future, expected an age of 0 or more");
  return age;
}

Time decode_none(std::span<const std::uint8_t> payload) {
  require_length(payload, 8, "answer");
  return take_time(payload);
}

Time decode_cloud(std::span<const std::uint8_t> payload, OrganizedCloud& out) {
  if (payload.size() < kCloudFixedBytes) fail("cloud of " + std::to_string(payload.size()) + " bytes");
  std::span<const std::uint8_t> rest = payload;
  const Time now = take_time(rest);
  const Time stamp = take_time(rest);
  const auto frame = take<std::uint64_t>(rest);
  const auto width = take<std::uint32_t>(rest);
  const auto height = take<std::uint32_t>(rest);
  require_side(width, "width");
  require_side(height, "height");
  if (stamp > now) fail("cloud with a stamp later than the camera's time");
  const std::size_t count = static_cast<std::size_t>(width) * height;
  require_length(rest, count * kPointBytes, "points");
  out.stamp = stamp;
  out.frame = frame;
  out.width = static_cast<int>(width);
  out.height = static_cast<int>(height);
  out.points.resize(count);
  std::memcpy(static_cast<void*>(out.points.data()), rest.data(), rest.size());
  return now;
}

std::string default_camera_socket() {
  const char* const given = std::getenv("XDG_RUNTIME_DIR");
  const std::string user = std::to_string(geteuid());
  for (const std::string& folder :
       {std::string(given == nullptr ? "" : given), "/run/user/" + user, std::string("/run")}) {
    if (folder.starts_with('/') && access(folder.c_str(), W_OK | X_OK) == 0)
      return folder + "/walkman-hil/camera.sock";
  }
  return "/tmp/walkman-hil-" + user + "/camera.sock";
}

}  // namespace walkman::camera
