#pragma once

#include <string>
#include <vector>

#include <linux/can.h>
#include <linux/can/raw.h>

#include "drivers/can/socket_can.h"

namespace walkman::can {

/// A CAN_RAW socket bound to one interface; can be reopened with the same settings.
class RawSocket {
 public:
  /// Does not open anything. Throws std::runtime_error if the name cannot be an interface name.
  RawSocket(const std::string& interface_name, const SocketCanOptions& options);
  ~RawSocket();
  RawSocket(const RawSocket&) = delete;
  RawSocket& operator=(const RawSocket&) = delete;

  /// Opens the socket. Returns null on success, otherwise what failed; `errno` then holds the reason. A
  /// socket already open is kept if a new one cannot be opened. Does not allocate.
  [[nodiscard]] const char* open() noexcept;

  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }
  [[nodiscard]] bool carries_fd() const noexcept { return carries_fd_; }

  enum class Link { kGone, kDown, kUp };
  /// Queries the present state and the MTU of the interface of this name.
  [[nodiscard]] Link look() noexcept;

 private:
  [[nodiscard]] const char* set_up(int descriptor) const noexcept;

  std::string name_;
  std::vector<can_filter> filters_;
  can_err_mask_t errors_;
  int receive_buffer_;
  bool stamps_;
  int descriptor_ = -1;
  unsigned index_ = 0;
  bool carries_fd_ = false;
};

}  // namespace walkman::can
