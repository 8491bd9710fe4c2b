#include "drivers/can/socket_can.h"

#include <cerrno>
#include <stdexcept>
#include <system_error>

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "drivers/can/stamp_clock.h"

namespace walkman::can {
namespace {

// Frames taken from the kernel with one system call.
constexpr unsigned kBatch = 32;
constexpr std::size_t kControlBytes = CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t));

Time time_of(const timespec& t) {
  return std::chrono::seconds(t.tv_sec) + std::chrono::nanoseconds(t.tv_nsec);
}

Time read_clock(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return time_of(t);
}

[[noreturn]] void fail(const std::string& name, const std::string& what, int error) {
  throw std::runtime_error(name + ": " + what + " (" + std::generic_category().message(error) + ")");
}

bool is_link_lost(int error) {
  return error == ENETDOWN || error == ENODEV || error == ENXIO || error == ENETUNREACH || error == EBADF;
}

}  // namespace

std::vector<IdFilter> canopen_master_filters() {
  constexpr std::uint32_t kFunctionCode = 0x780;
  std::vector<IdFilter> filters;
  for (const std::uint32_t function : {0x080U, 0x180U, 0x280U, 0x380U, 0x480U, 0x580U, 0x700U}) {
    filters.push_back({function, kFunctionCode});
  }
  return filters;
}

struct SocketCan::Impl {
  explicit Impl(const std::string& interface_name) : name(interface_name) {}
  ~Impl() {
    if (descriptor >= 0) close(descriptor);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void open(const SocketCanOptions& options);
  bool refill() noexcept;
  bool convert(unsigned slot, StampedFrame& out) noexcept;
  void on_error_frame(const canfd_frame& raw) noexcept;

  std::string name;
  int descriptor = -1;
  bool bus_off = false;
  std::uint64_t overflows = 0;
  std::uint32_t kernel_drops = 0;
  StampClock clock;
  unsigned next = 0, count = 0;
  std::array<canfd_frame, kBatch> frames{};
  std::array<iovec, kBatch> vectors{};
  std::array<mmsghdr, kBatch> messages{};
  struct alignas(cmsghdr) Control {
    std::array<char, kControlBytes> bytes;
  };
  std::array<Control, kBatch> controls{};
};

void SocketCan::Impl::open(const SocketCanOptions& options) {
  if (name.empty() || name.size() >= IFNAMSIZ) {
    throw std::runtime_error("CAN interface \"" + name + "\": the name has " + std::to_string(name.size()) +
                             " characters, expected 1 to " + std::to_string(IFNAMSIZ - 1));
  }
  descriptor = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (descriptor < 0) {
    const int error = errno;
    if (error == EAFNOSUPPORT || error == EPROTONOSUPPORT) {
      fail(name, "no such CAN interface, this kernel has no CAN sockets", error);
    }
    fail(name, "cannot open a CAN socket", error);
  }
  const unsigned index = if_nametoindex(name.c_str());
  if (index == 0) fail(name, "no such CAN interface", errno);

  std::vector<can_filter> filters;
  for (const IdFilter& filter : options.filters) {
    filters.push_back({filter.id, (filter.mask & CAN_SFF_MASK) | CAN_EFF_FLAG | CAN_RTR_FLAG});
  }
  const can_err_mask_t errors = CAN_ERR_BUSOFF | CAN_ERR_RESTARTED;
  const int on = 1;
  if (setsockopt(descriptor, SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(),
                 static_cast<socklen_t>(filters.size() * sizeof(can_filter))) != 0 ||
      setsockopt(descriptor, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors) != 0 ||
      setsockopt(descriptor, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) != 0 ||
      setsockopt(descriptor, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on) != 0) {
    fail(name, "cannot set up the CAN socket", errno);
  }
  // Best effort: FD frames need an FD interface, and only root may exceed rmem_max.
  setsockopt(descriptor, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on);
  if (setsockopt(descriptor, SOL_SOCKET, SO_RCVBUFFORCE, &options.receive_buffer, sizeof(int)) != 0) {
    setsockopt(descriptor, SOL_SOCKET, SO_RCVBUF, &options.receive_buffer, sizeof(int));
  }

  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(index);
  if (bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    const int error = errno;
    fail(name, error == ENODEV ? "is no CAN interface" : "cannot bind the CAN socket", error);
  }
  for (unsigned i = 0; i < kBatch; ++i) {
    vectors[i] = {&frames[i], sizeof(canfd_frame)};
    messages[i].msg_hdr.msg_iov = &vectors[i];
    messages[i].msg_hdr.msg_iovlen = 1;
  }
}

SocketCan::SocketCan(const std::string& interface_name, const SocketCanOptions& options)
    : impl_(std::make_unique<Impl>(interface_name)) {
  impl_->open(options);
}

SocketCan::~SocketCan() = default;

SendResult SocketCan::send(const Frame& frame) noexcept {
  if (impl_->bus_off) return SendResult::kInterfaceDown;
  canfd_frame raw{};
  raw.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0U) | (frame.remote ? CAN_RTR_FLAG : 0U);
  raw.len = frame.fd ? frame.length : std::min<std::uint8_t>(frame.length, CAN_MAX_DLEN);
  if (frame.fd) raw.flags = CANFD_BRS;
  std::memcpy(raw.data, frame.data.data(), raw.len);
  const std::size_t size = frame.fd ? CANFD_MTU : CAN_MTU;
  if (::send(impl_->descriptor, &raw, size, 0) == static_cast<ssize_t>(size)) return SendResult::kQueued;
  return is_link_lost(errno) ? SendResult::kInterfaceDown : SendResult::kQueueFull;
}

bool SocketCan::Impl::refill() noexcept {
  next = count = 0;
  for (unsigned i = 0; i < kBatch; ++i) {
    messages[i].msg_hdr.msg_control = controls[i].bytes.data();
    messages[i].msg_hdr.msg_controllen = kControlBytes;
  }
  const int taken = recvmmsg(descriptor, messages.data(), kBatch, MSG_DONTWAIT, nullptr);
  if (taken <= 0) return false;
  count = static_cast<unsigned>(taken);
  clock.update(read_clock(CLOCK_MONOTONIC), read_clock(CLOCK_REALTIME));
  return true;
}

void SocketCan::Impl::on_error_frame(const canfd_frame& raw) noexcept {
  if ((raw.can_id & CAN_ERR_BUSOFF) != 0) bus_off = true;
  if ((raw.can_id & CAN_ERR_RESTARTED) != 0) bus_off = false;
}

bool SocketCan::Impl::convert(unsigned slot, StampedFrame& out) noexcept {
  const canfd_frame& raw = frames[slot];
  const msghdr& header = messages[slot].msg_hdr;
  Time stamp = read_clock(CLOCK_MONOTONIC);
  for (const cmsghdr* control = CMSG_FIRSTHDR(&header); control != nullptr;
       control = CMSG_NXTHDR(const_cast<msghdr*>(&header), const_cast<cmsghdr*>(control))) {
    if (control->cmsg_level != SOL_SOCKET) continue;
    if (control->cmsg_type == SCM_TIMESTAMPNS) {
      timespec t{};
      std::memcpy(&t, CMSG_DATA(control), sizeof t);
      stamp = clock.monotonic(time_of(t));
    } else if (control->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t drops = 0;
      std::memcpy(&drops, CMSG_DATA(control), sizeof drops);
      overflows += drops - kernel_drops;  // the kernel's counter wraps at 32 bits
      kernel_drops = drops;
    }
  }
  if ((raw.can_id & CAN_ERR_FLAG) != 0) {
    on_error_frame(raw);
    return false;
  }
  bus_off = false;
  out.time = stamp;
  out.frame.extended = (raw.can_id & CAN_EFF_FLAG) != 0;
  out.frame.remote = (raw.can_id & CAN_RTR_FLAG) != 0;
  out.frame.fd = messages[slot].msg_len == CANFD_MTU;
  out.frame.id = raw.can_id & (out.frame.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  out.frame.length = std::min<std::uint8_t>(raw.len, out.frame.fd ? CANFD_MAX_DLEN : CAN_MAX_DLEN);
  std::memcpy(out.frame.data.data(), raw.data, out.frame.length);
  return true;
}

bool SocketCan::receive(StampedFrame& out) noexcept {
  while (true) {
    if (impl_->next == impl_->count && !impl_->refill()) return false;
    if (impl_->convert(impl_->next++, out)) return true;
  }
}

std::uint64_t SocketCan::receive_overflows() const noexcept { return impl_->overflows; }

std::string_view SocketCan::name() const noexcept { return impl_->name; }

}  // namespace walkman::can
