#include "drivers/can/receive_batch.h"

#include <cerrno>
#include <cstring>

#include <time.h>

namespace walkman::can {
namespace {

Time time_of(const timespec& t) {
  return std::chrono::seconds(t.tv_sec) + std::chrono::nanoseconds(t.tv_nsec);
}

Time read_clock(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return time_of(t);
}

void convert(const canfd_frame& raw, bool fd, Frame& out) noexcept {
  out.error = (raw.can_id & CAN_ERR_FLAG) != 0;
  out.extended = !out.error && (raw.can_id & CAN_EFF_FLAG) != 0;
  out.remote = !out.error && (raw.can_id & CAN_RTR_FLAG) != 0;
  out.fd = fd;
  out.id = raw.can_id & (out.extended || out.error ? CAN_EFF_MASK : CAN_SFF_MASK);
  out.length = std::min<std::uint8_t>(raw.len, fd ? CANFD_MAX_DLEN : CAN_MAX_DLEN);
  std::memcpy(out.data.data(), raw.data, out.length);
}

}  // namespace

ReceiveBatch::ReceiveBatch() noexcept {
  for (unsigned i = 0; i < kBatch; ++i) {
    vectors_[i] = {&frames_[i], sizeof(canfd_frame)};
    messages_[i].msg_hdr.msg_iov = &vectors_[i];
    messages_[i].msg_hdr.msg_iovlen = 1;
  }
}

int ReceiveBatch::take(int descriptor) noexcept {
  next_ = count_ = 0;
  for (unsigned i = 0; i < kBatch; ++i) {
    messages_[i].msg_hdr.msg_control = controls_[i].bytes.data();
    messages_[i].msg_hdr.msg_controllen = kControlBytes;
  }
  const int taken = recvmmsg(descriptor, messages_.data(), kBatch, MSG_DONTWAIT, nullptr);
  if (taken < 0) return errno;
  if (taken == 0) return EAGAIN;
  count_ = static_cast<unsigned>(taken);
  clock_.update(read_clock(CLOCK_MONOTONIC), read_clock(CLOCK_REALTIME));
  return 0;
}

std::uint32_t ReceiveBatch::next(StampedFrame& out) noexcept {
  const unsigned slot = next_++;
  const msghdr& header = messages_[slot].msg_hdr;
  std::uint32_t lost = 0;
  bool stamped = false;
  for (const cmsghdr* control = CMSG_FIRSTHDR(&header); control != nullptr;
       control = CMSG_NXTHDR(const_cast<msghdr*>(&header), const_cast<cmsghdr*>(control))) {
    if (control->cmsg_level != SOL_SOCKET) continue;
    if (control->cmsg_type == SCM_TIMESTAMPNS) {
      timespec t{};
      std::memcpy(&t, CMSG_DATA(control), sizeof t);
      out.time = clock_.monotonic(time_of(t));
      stamped = true;
    } else if (control->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t dropped = 0;
      std::memcpy(&dropped, CMSG_DATA(control), sizeof dropped);
      lost = dropped - dropped_;
      dropped_ = dropped;
    }
  }
  if (!stamped) out.time = read_clock(CLOCK_MONOTONIC);
  convert(frames_[slot], messages_[slot].msg_len == CANFD_MTU, out.frame);
  return lost;
}

}  // namespace walkman::can
