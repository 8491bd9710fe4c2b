#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/camera/range_camera.h"

/// The camera's clouds over a local stream socket. Every message is a header of 12 bytes, "WMCL", u16 version
/// 2, u16 type, u32 payload bytes, and the payload; all numbers little-endian, times i64 in ns.
///
/// | type | from | payload |
/// |---|---|---|
/// | 1 hello | server, first | camera's time, width u32, height u32 |
/// | 2 request | client | age i64: the oldest cloud that will do was exposed this long ago |
/// | 3 none | server | camera's time |
/// | 4 cloud | server | camera's time, stamp i64, frame u64, width u32, height u32, points 3×f32 each |
///
/// The two programs' clocks have nothing in common, so an age crosses, never an instant of the other's clock.
namespace walkman::camera {

inline constexpr std::size_t kHeaderBytes = 12;
/// Payload of a cloud without its points.
inline constexpr std::size_t kCloudFixedBytes = 8 + 8 + 8 + 4 + 4;
/// Longest side of a cloud, pixels.
inline constexpr std::uint32_t kMaxSide = 4096;

enum class MessageType : std::uint16_t { kHello = 1, kRequest = 2, kNone = 3, kCloud = 4 };

/// What a camera says of itself.
struct Hello {
  Time now{};                           ///< on its own clock
  std::uint32_t width = 0, height = 0;  ///< of its clouds, pixels
};

struct MessageHeader {
  MessageType type{};
  std::uint32_t length = 0;
};

/// Reads a header. Throws std::runtime_error in one sentence for what is no header of this protocol, or a
/// length that its type cannot have.
[[nodiscard]] MessageHeader read_header(std::span<const std::uint8_t, kHeaderBytes> bytes);

[[nodiscard]] std::vector<std::uint8_t> encode(const Hello& hello);
[[nodiscard]] std::vector<std::uint8_t> encode_request(Time age);
[[nodiscard]] std::vector<std::uint8_t> encode_none(Time now);
/// Header and first part of a cloud's message; `now` is the camera's time. Its points follow on the wire as
/// they lie in memory: floats of a little-endian machine, as little_endian.h asserts.
[[nodiscard]] std::vector<std::uint8_t> encode_cloud_head(Time now, const OrganizedCloud& cloud);

/// These read a payload and throw std::runtime_error for one that does not hold together.
[[nodiscard]] Hello decode_hello(std::span<const std::uint8_t> payload);
[[nodiscard]] Time decode_request(std::span<const std::uint8_t> payload);
[[nodiscard]] Time decode_none(std::span<const std::uint8_t> payload);
/// Returns the camera's time; the cloud keeps the camera's stamp.
[[nodiscard]] Time decode_cloud(std::span<const std::uint8_t> payload, OrganizedCloud& out);

/// Where the emulator's socket lies if nobody says otherwise: `camera.sock` in the folder `walkman-hil` of
/// $XDG_RUNTIME_DIR, else of /run/user/UID, else of /run when that can be written, else in
/// /tmp/walkman-hil-UID. The folder is for its owner alone.
[[nodiscard]] std::string default_camera_socket();

}  // namespace walkman::camera
