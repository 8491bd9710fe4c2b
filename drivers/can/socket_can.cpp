#include "drivers/can/socket_can.h"

#include <algorithm>
#include <cerrno>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <linux/can/error.h>
#include <time.h>

#include "drivers/can/raw_socket.h"
#include "drivers/can/receive_batch.h"
#include "drivers/can/transmit_batch.h"

namespace walkman::can {
namespace {

// How often `receive` checks whether an interface that is down or gone has come back.
constexpr Time kLookPeriod = std::chrono::milliseconds(100);
constexpr std::size_t kMaxTransmitQueue = 1024;

Time monotonic_now() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::chrono::seconds(t.tv_sec) + std::chrono::nanoseconds(t.tv_nsec);
}

bool is_gone(int error) { return error == ENODEV || error == ENXIO || error == EBADF; }
bool is_down(int error) { return error == ENETDOWN || error == ENETUNREACH; }

std::uint8_t controller_bits(const Frame& frame) noexcept {
  return (frame.id & CAN_ERR_CRTL) != 0 && frame.length >= 2 ? frame.data[1] : std::uint8_t{0};
}

}  // namespace

LinkState link_after(const Frame& error_frame, LinkState before) noexcept {
  if ((error_frame.id & CAN_ERR_BUSOFF) != 0) return LinkState::kBusOff;
  if ((error_frame.id & CAN_ERR_RESTARTED) != 0) return LinkState::kActive;
  const unsigned bits = controller_bits(error_frame);
  if ((bits & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0) return LinkState::kPassive;
  if ((bits & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING)) != 0) return LinkState::kWarning;
  if ((bits & CAN_ERR_CRTL_ACTIVE) != 0) return LinkState::kActive;
  return before;
}

bool tells_receive_overflow(const Frame& error_frame) noexcept {
  return (controller_bits(error_frame) & CAN_ERR_CRTL_RX_OVERFLOW) != 0;
}

SocketCanOptions device_side_options() {
  SocketCanOptions options;
  options.error_frames = true;
  options.stamps = false;  // the bus has its own time
  options.transmit_queue = kMaxTransmitQueue;
  return options;
}

struct SocketCan::Impl {
  Impl(const std::string& interface_name, const SocketCanOptions& options)
      : name(interface_name),
        socket(interface_name, options),
        transmit(std::clamp<std::size_t>(options.transmit_queue, 1, kMaxTransmitQueue)),
        received(options.stamps),
        hand_out_reports(options.error_frames) {}

  void lose_link(int error) noexcept;
  void look() noexcept;
  [[nodiscard]] bool time_to_look() const noexcept { return monotonic_now() - looked_at >= kLookPeriod; }
  void flush() noexcept;
  bool refill() noexcept;
  bool take_report(const Frame& report) noexcept;

  std::string name;
  RawSocket socket;
  TransmitBatch transmit;
  ReceiveBatch received;
  bool hand_out_reports;
  LinkState link = LinkState::kActive;
  bool gone = false;
  bool looked = false;  // since the last flush
  Time looked_at{};
  std::uint64_t generation = 0;
  std::uint64_t overflows = 0;
  Statistics statistics;
};

void SocketCan::Impl::lose_link(int error) noexcept {
  if (link != LinkState::kDown) ++statistics.downs;
  link = LinkState::kDown;
  gone = gone || is_gone(error);
  statistics.dropped += transmit.clear();
  looked_at = monotonic_now();
}

void SocketCan::Impl::look() noexcept {
  looked = true;
  looked_at = monotonic_now();
  if (!gone) {
    switch (socket.look()) {
      case RawSocket::Link::kUp:
        link = LinkState::kActive;
        return;
      case RawSocket::Link::kDown:
        return;
      case RawSocket::Link::kGone:
        gone = true;
        break;
    }
  }
  if (socket.open() != nullptr) return;
  gone = false;
  ++generation;
  received.restart();
  link = socket.look() == RawSocket::Link::kUp ? LinkState::kActive : LinkState::kDown;
}

void SocketCan::Impl::flush() noexcept {
  if (link == LinkState::kDown && !looked) look();
  looked = false;
  bool told = false;
  while (!transmit.empty()) {
    const int error = transmit.hand_over(socket.descriptor());
    if (error == 0 || error == EINTR) continue;
    // The socket reports a link failure once, even if it is over by then.
    if (is_down(error) && !std::exchange(told, true) && socket.look() == RawSocket::Link::kUp) {
      ++statistics.downs;
      continue;
    }
    if (is_gone(error) || is_down(error)) return lose_link(error);
    if (error == ENOBUFS || error == EAGAIN) {
      ++statistics.queue_full;
      return;
    }
    // A frame this interface cannot carry, for instance after a change of its MTU, must not block those
    // behind it.
    transmit.drop_first();
    ++statistics.dropped;
    static_cast<void>(socket.look());
  }
}

bool SocketCan::Impl::refill() noexcept {
  for (int attempt = 0; attempt < 2; ++attempt) {
    const int error = received.take(socket.descriptor());
    if (error == 0) return true;
    if (!is_gone(error) && !is_down(error)) return false;
    // The socket reports once that the link failed; frames received before may still be queued.
    lose_link(error);
  }
  return false;
}

bool SocketCan::Impl::take_report(const Frame& report) noexcept {
  ++statistics.reports;
  if (link != LinkState::kDown) link = link_after(report, link);
  if (tells_receive_overflow(report)) ++overflows;
  if (link == LinkState::kBusOff) statistics.dropped += transmit.clear();
  return hand_out_reports;
}

SocketCan::SocketCan(const std::string& interface_name, const SocketCanOptions& options)
    : impl_(std::make_unique<Impl>(interface_name, options)) {
  if (const char* failed = impl_->socket.open()) {
    throw std::runtime_error(interface_name + ": " + failed + " (" + std::generic_category().message(errno) +
                             ")");
  }
  if (impl_->socket.look() != RawSocket::Link::kUp) impl_->link = LinkState::kDown;
}

SocketCan::~SocketCan() = default;

SendResult SocketCan::send(const Frame& frame) noexcept {
  Impl& self = *impl_;
  if (self.link == LinkState::kDown && (!self.looked || self.time_to_look())) self.look();
  if (self.link == LinkState::kDown || self.link == LinkState::kBusOff) return SendResult::kInterfaceDown;
  if (frame.fd && !self.socket.carries_fd()) return SendResult::kInvalid;
  if (!frame.fd && frame.length > CAN_MAX_DLEN) return SendResult::kInvalid;
  if (self.transmit.full()) self.flush();
  if (self.link == LinkState::kDown) return SendResult::kInterfaceDown;
  if (self.transmit.full()) return SendResult::kQueueFull;
  self.transmit.add(frame);
  return SendResult::kQueued;
}

void SocketCan::flush() noexcept { impl_->flush(); }

bool SocketCan::flush_all(Time limit) noexcept {
  constexpr timespec kPause{0, 1'000'000};
  const Time ends = monotonic_now() + limit;
  impl_->flush();
  while (waiting() > 0 && monotonic_now() < ends) {
    nanosleep(&kPause, nullptr);
    impl_->flush();
  }
  return waiting() == 0;
}

bool SocketCan::receive(StampedFrame& out) noexcept {
  Impl& self = *impl_;
  while (true) {
    // A batch that was not full has emptied the queue: asking again at once would waste a system call.
    if (self.received.empty() && (self.received.was_last() || !self.refill())) {
      if (self.link == LinkState::kDown && self.time_to_look()) self.look();
      return false;
    }
    self.overflows += self.received.next(out);
    if (out.frame.error) {
      if (self.take_report(out.frame)) return true;
      continue;
    }
    // Frames arrive only over a working link, even if the report of its recovery was missed.
    if (self.link == LinkState::kBusOff) self.link = LinkState::kActive;
    return true;
  }
}

LinkState SocketCan::link() const noexcept { return impl_->link; }
std::uint64_t SocketCan::receive_overflows() const noexcept { return impl_->overflows; }
std::string_view SocketCan::name() const noexcept { return impl_->name; }
int SocketCan::descriptor() const noexcept { return impl_->socket.descriptor(); }
std::uint64_t SocketCan::generation() const noexcept { return impl_->generation; }
std::size_t SocketCan::waiting() const noexcept { return impl_->transmit.size(); }
const SocketCan::Statistics& SocketCan::statistics() const noexcept { return impl_->statistics; }

}  // namespace walkman::can
