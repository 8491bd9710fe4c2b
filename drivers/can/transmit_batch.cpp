#include "drivers/can/transmit_batch.h"

#include <cerrno>
#include <cstring>

namespace walkman::can {

TransmitBatch::TransmitBatch(std::size_t capacity)
    : frames_(capacity), vectors_(capacity), messages_(capacity) {
  for (std::size_t i = 0; i < capacity; ++i) {
    vectors_[i] = {&frames_[i], CAN_MTU};
    messages_[i].msg_hdr.msg_iov = &vectors_[i];
    messages_[i].msg_hdr.msg_iovlen = 1;
  }
}

void TransmitBatch::move_to_front() noexcept {
  const std::size_t count = size();
  for (std::size_t i = 0; i < count; ++i) {
    frames_[i] = frames_[begin_ + i];
    vectors_[i].iov_len = vectors_[begin_ + i].iov_len;
  }
  begin_ = 0;
  end_ = count;
}

void TransmitBatch::add(const Frame& frame) noexcept {
  if (end_ == frames_.size()) move_to_front();
  canfd_frame& raw = frames_[end_];
  raw = {};
  raw.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0U) | (frame.remote ? CAN_RTR_FLAG : 0U) |
               (frame.error ? CAN_ERR_FLAG : 0U);
  raw.len = frame.fd ? fd_length(frame.length) : frame.length;
  if (frame.fd) raw.flags = CANFD_BRS;
  std::memcpy(raw.data, frame.data.data(), frame.length);
  vectors_[end_].iov_len = frame.fd ? CANFD_MTU : CAN_MTU;
  ++end_;
}

int TransmitBatch::hand_over(int descriptor) noexcept {
  const int taken = sendmmsg(descriptor, &messages_[begin_], static_cast<unsigned>(size()), MSG_DONTWAIT);
  if (taken < 0) return errno;
  begin_ += static_cast<std::size_t>(taken);
  if (begin_ == end_) begin_ = end_ = 0;
  return 0;
}

void TransmitBatch::drop_first() noexcept {
  if (++begin_ == end_) begin_ = end_ = 0;
}

std::size_t TransmitBatch::clear() noexcept {
  const std::size_t count = size();
  begin_ = end_ = 0;
  return count;
}

}  // namespace walkman::can
