#pragma once

#include <cstddef>
#include <vector>

#include <linux/can.h>
#include <sys/socket.h>

#include "drivers/can/frame.h"

namespace walkman::can {

/// Frames on their way to the kernel, in order, handed over many at a time. Allocates when made only.
class TransmitBatch {
 public:
  /// Room for `capacity` frames.
  explicit TransmitBatch(std::size_t capacity);

  [[nodiscard]] bool empty() const noexcept { return size() == 0; }
  [[nodiscard]] bool full() const noexcept { return size() == frames_.size(); }
  [[nodiscard]] std::size_t size() const noexcept { return end_ - begin_; }

  /// Only when not `full`.
  void add(const Frame& frame) noexcept;

  /// One sendmmsg over what is there; what the kernel took is gone from here. 0, or the error number with
  /// which it refused the first.
  [[nodiscard]] int hand_over(int descriptor) noexcept;

  /// Only when not `empty`.
  void drop_first() noexcept;
  /// How many there were.
  std::size_t clear() noexcept;

 private:
  void move_to_front() noexcept;

  std::vector<canfd_frame> frames_;
  std::vector<iovec> vectors_;
  std::vector<mmsghdr> messages_;
  std::size_t begin_ = 0, end_ = 0;
};

}  // namespace walkman::can
