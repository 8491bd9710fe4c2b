#pragma once

#include <array>

#include <linux/can.h>
#include <sys/socket.h>

#include "drivers/can/frame.h"
#include "drivers/can/stamp_clock.h"

namespace walkman::can {

/// Frames taken from the kernel many at a time, with their stamps and the kernel's count of lost ones.
class ReceiveBatch {
 public:
  ReceiveBatch() noexcept;
  ReceiveBatch(const ReceiveBatch&) = delete;
  ReceiveBatch& operator=(const ReceiveBatch&) = delete;

  [[nodiscard]] bool empty() const noexcept { return next_ == count_; }

  /// One recvmmsg. 0, or the error number. Only when `empty`.
  [[nodiscard]] int take(int descriptor) noexcept;

  /// The oldest frame; how many frames the kernel had to drop before it. Only when not `empty`.
  [[nodiscard]] std::uint32_t next(StampedFrame& out) noexcept;

  /// A new socket counts from zero.
  void restart() noexcept { dropped_ = 0; }

 private:
  static constexpr unsigned kBatch = 32;
  static constexpr std::size_t kControlBytes =
      CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t));
  struct alignas(cmsghdr) Control {
    std::array<char, kControlBytes> bytes;
  };

  unsigned next_ = 0, count_ = 0;
  std::uint32_t dropped_ = 0;  // the kernel's counter, which wraps
  StampClock clock_;
  std::array<canfd_frame, kBatch> frames_{};
  std::array<iovec, kBatch> vectors_{};
  std::array<mmsghdr, kBatch> messages_{};
  std::array<Control, kBatch> controls_{};
};

}  // namespace walkman::can
