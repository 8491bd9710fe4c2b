#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "drivers/can/interface.h"

namespace walkman::can {

/// What the kernel tells about a network interface. What a driver does not have stays empty: a virtual
/// interface has no bit rate, no controller and no error counters.
struct LinkInfo {
  std::string name;
  std::string kind;  ///< "can", "vcan", "vxcan"; empty when the driver gives none
  int index = 0;
  bool up = false;
  std::uint32_t mtu = 0;           ///< 16 classical CAN, 72 CAN FD
  std::uint32_t queue_length = 0;  ///< transmit queue, frames
  std::optional<LinkState> controller;
  std::optional<std::uint32_t> bit_rate;       ///< bit/s
  std::optional<std::uint32_t> data_bit_rate;  ///< bit/s, of CAN FD's second rate
  std::optional<std::uint32_t> restart_ms;     ///< automatic restart after bus-off; 0 is none
  std::optional<std::uint16_t> transmit_errors, receive_errors;  ///< TEC, REC

  [[nodiscard]] bool carries_fd() const noexcept { return mtu >= 72; }
};

/// Asks by rtnetlink; changes nothing. Throws std::runtime_error with name and reason.
[[nodiscard]] LinkInfo read_link_info(const std::string& interface_name);

/// One line for people: "vcan0: vcan, up, classical frames (mtu 16), no bit rate (virtual)".
[[nodiscard]] std::string describe(const LinkInfo& info);

/// What became of `request_bit_rate`.
struct BitRateReply {
  bool set = false;
  std::string text;  ///< one sentence, also when it was set
};

/// Asks the driver behind an interface for a bit rate, as `ip link set NAME type can bitrate N` does. A
/// refusal is an answer, not an error: virtual interfaces have no bit rate, and changing one needs privileges
/// and an interface that is down.
[[nodiscard]] BitRateReply request_bit_rate(const std::string& interface_name, std::uint32_t bit_rate);

}  // namespace walkman::can
