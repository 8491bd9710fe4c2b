#pragma once

#include <cstdint>

namespace walkman::canopen {

/// NMT command specifiers (CiA 301, 7.2.8.3.1).
enum class NmtCommand : std::uint8_t {
  kStart = 0x01,
  kStop = 0x02,
  kEnterPreOperational = 0x80,
  kResetNode = 0x81,
  kResetCommunication = 0x82,
};

/// NMT states as reported by heartbeat and boot-up messages (CiA 301, 7.2.8.3.2).
enum class NmtState : std::uint8_t {
  kBootUp = 0x00,
  kStopped = 0x04,
  kOperational = 0x05,
  kPreOperational = 0x7F,
};

/// COB-IDs of the predefined connection set (CiA 301, 7.3.5). RPDO and TPDO as the device sees them.
namespace cob_id {

inline constexpr std::uint32_t kNmt = 0x000;
inline constexpr std::uint32_t kSync = 0x080;
inline constexpr std::uint32_t kTime = 0x100;

[[nodiscard]] constexpr std::uint32_t emcy(std::uint8_t node) noexcept { return 0x080U + node; }
/// `number` is 1..4.
[[nodiscard]] constexpr std::uint32_t tpdo(int number, std::uint8_t node) noexcept {
  return 0x080U + static_cast<std::uint32_t>(number) * 0x100U + node;
}
/// `number` is 1..4.
[[nodiscard]] constexpr std::uint32_t rpdo(int number, std::uint8_t node) noexcept {
  return 0x100U + static_cast<std::uint32_t>(number) * 0x100U + node;
}
[[nodiscard]] constexpr std::uint32_t sdo_response(std::uint8_t node) noexcept { return 0x580U + node; }
[[nodiscard]] constexpr std::uint32_t sdo_request(std::uint8_t node) noexcept { return 0x600U + node; }
[[nodiscard]] constexpr std::uint32_t error_control(std::uint8_t node) noexcept { return 0x700U + node; }

}  // namespace cob_id

}  // namespace walkman::canopen
