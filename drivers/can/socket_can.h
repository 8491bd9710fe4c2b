#pragma once

#include <memory>
#include <string>
#include <vector>

#include "drivers/can/interface.h"

namespace walkman::can {

/// Lets frames with (id & mask) == (filter.id & mask) in; base format only.
struct IdFilter {
  std::uint32_t id = 0;
  std::uint32_t mask = 0;
};

/// What a CANopen master listens to: EMCY (and SYNC), TPDOs, SDO responses, error control.
[[nodiscard]] std::vector<IdFilter> canopen_master_filters();

struct SocketCanOptions {
  std::vector<IdFilter> filters = canopen_master_filters();
  int receive_buffer = 4 * 1024 * 1024;  ///< bytes asked of the kernel, which may grant less
};

/// A network interface of the Linux kernel (vcan, can) as a bus end: a non-blocking CAN_RAW socket.
///
/// Frames carry the kernel's receive time, converted to CLOCK_MONOTONIC. A link that is down, deleted or
/// bus-off is `SendResult::kInterfaceDown`. The same object works again after `ip link set up` or a bus-off
/// restart; after the link was deleted a new one has to be made. Bit rate and restart time are set with `ip
/// link`, not here.
class SocketCan final : public Interface {
 public:
  /// Throws std::runtime_error: interface name and reason, when the kernel has no CAN, the interface does not
  /// exist, is no CAN interface, or the socket cannot be set up.
  explicit SocketCan(const std::string& interface_name, const SocketCanOptions& options = {});
  ~SocketCan() override;
  SocketCan(const SocketCan&) = delete;
  SocketCan& operator=(const SocketCan&) = delete;

  [[nodiscard]] SendResult send(const Frame& frame) noexcept override;
  [[nodiscard]] bool receive(StampedFrame& out) noexcept override;
  [[nodiscard]] std::uint64_t receive_overflows() const noexcept override;
  [[nodiscard]] std::string_view name() const noexcept override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace walkman::can
