#pragma once

#include <string>

#include "drivers/camera/multisense/datagram.h"

namespace walkman::multisense {

/// An IPv4 address and port, as text "127.0.0.1" or "10.66.171.21:9001".
struct UdpAddress {
  std::uint32_t host = 0;  ///< in the host's byte order
  std::uint16_t port = 0;
};
/// Throws std::runtime_error with what was found and expected. The port defaults to the device's own.
[[nodiscard]] UdpAddress parse_udp_address(const std::string& text);

/// A UDP socket connected to a device.
class UdpPort final : public DatagramPort {
 public:
  /// Throws std::runtime_error with the address if no socket can be opened for it.
  explicit UdpPort(const std::string& address);
  ~UdpPort() override;
  UdpPort(const UdpPort&) = delete;
  UdpPort& operator=(const UdpPort&) = delete;

  void send(std::span<const std::uint8_t> datagram) override;
  [[nodiscard]] bool receive(std::vector<std::uint8_t>& datagram) override;
  [[nodiscard]] bool wait(Time limit) override;

 private:
  int socket_ = -1;
};

}  // namespace walkman::multisense
