#pragma once

#include <cstddef>
#include <vector>

#include <linux/can.h>
#include <sys/socket.h>

#include "drivers/can/frame.h"

namespace walkman::can {

/// Frames to be handed to the kernel, in order, many at a time. Allocates only on construction.
class TransmitBatch {
 public:
  /// Room for `capacity` frames.
  explicit TransmitBatch(std::size_t capacity);

  [[nodiscard]] bool empty() const noexcept { return size() == 0; }
  [[nodiscard]] bool full() const noexcept { return size() == frames_.size(); }
  [[nodiscard]] std::size_t size() const noexcept { return end_ - begin_; }

  /// Call only when not `full`.
  void add(const Frame& frame) noexcept;

  /// Calls sendmmsg once for all frames and removes those the kernel accepted. Returns 0, or the error number
  /// with which it refused the first.
  [[nodiscard]] int hand_over(int descriptor) noexcept;

  /// Call only when not `empty`.
  void drop_first() noexcept;
  /// Removes all frames; returns how many there were.
  std::size_t clear() noexcept;

 private:
  void move_to_front() noexcept;

  std::vector<canfd_frame> frames_;
  std::vector<iovec> vectors_;
  std::vector<mmsghdr> messages_;
  std::size_t begin_ = 0, end_ = 0;
};

}  // namespace walkman::can
