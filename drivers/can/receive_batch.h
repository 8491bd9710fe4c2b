#pragma once

#include <array>

#include <linux/can.h>
#include <sys/socket.h>

#include "drivers/can/frame.h"
#include "drivers/can/stamp_clock.h"

namespace walkman::can {

/// Frames taken from the kernel in batches, with their stamps and the kernel's count of lost frames.
class ReceiveBatch {
 public:
  /// `stamps`: the socket stamps every frame with its receive time; otherwise frames carry no time.
  explicit ReceiveBatch(bool stamps) noexcept;
  ReceiveBatch(const ReceiveBatch&) = delete;
  ReceiveBatch& operator=(const ReceiveBatch&) = delete;

  [[nodiscard]] bool empty() const noexcept { return next_ == count_; }

  /// Whether the last batch emptied the kernel's queue; returns true only once per batch.
  [[nodiscard]] bool was_last() noexcept {
    const bool last = last_;
    last_ = false;
    return last;
  }

  /// Calls recvmmsg once. Returns 0, or the error number. Call only when `empty`.
  [[nodiscard]] int take(int descriptor) noexcept;

  /// Takes the oldest frame; returns how many frames the kernel dropped before it. Only when not `empty`.
  [[nodiscard]] std::uint32_t next(StampedFrame& out) noexcept;

  /// Call for a new socket, whose count starts at zero.
  void restart() noexcept { dropped_ = 0; }

 private:
  static constexpr unsigned kBatch = 32;
  static constexpr std::size_t kControlBytes =
      CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t));
  struct alignas(cmsghdr) Control {
    std::array<char, kControlBytes> bytes;
  };

  bool stamps_;
  bool last_ = false;
  unsigned next_ = 0, count_ = 0;
  std::uint32_t dropped_ = 0;  // the kernel's counter, which wraps
  StampClock clock_;
  std::array<canfd_frame, kBatch> frames_{};
  std::array<iovec, kBatch> vectors_{};
  std::array<mmsghdr, kBatch> messages_{};
  std::array<Control, kBatch> controls_{};
};

}  // namespace walkman::can
