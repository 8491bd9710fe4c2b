#pragma once

#include <memory>
#include <string>
#include <vector>

#include "drivers/can/interface.h"

namespace walkman::can {

struct SocketCanOptions {
  bool listens = true;        ///< frames of other sockets and nodes come in, of any format; else only reports
  bool error_frames = false;  ///< `receive` hands out the controller's reports too (`Frame::error`)
  bool stamps = true;         ///< frames carry their receive time; without, no clock is read for them
  int receive_buffer = 4 * 1024 * 1024;  ///< bytes asked of the kernel, which may grant less
  std::size_t transmit_queue = 128;      ///< frames gathered at most, 1 to 1024
};

/// For what stands for a bus's devices: gets the controller's reports too. Own frames are not received; other
/// sockets of the same host get them.
[[nodiscard]] SocketCanOptions device_side_options();

/// A network interface of the Linux kernel (vcan, can) as a connection to a bus: one non-blocking CAN_RAW
/// socket.
///
/// `send` gathers frames and `flush` hands them to the kernel with one call. What the kernel's queue does not
/// take (ENOBUFS, EAGAIN) stays gathered, in order, and is offered again by the next `flush`; when the
/// gathering place is full too, `send` is `kQueueFull`. Frames carry the kernel's receive time, converted to
/// CLOCK_MONOTONIC.
///
/// A link that is down, gone or bus-off makes `send` kInterfaceDown and drops what was gathered: set-points
/// of before the break are worth nothing after it. After `ip link set up` or a bus-off restart the same
/// socket goes on. After the interface was deleted a new socket is opened as soon as an interface of that
/// name is there; it is looked for once between two calls of `flush`, and in `receive` every 100 ms. Bit rate
/// and restart time are set with `ip link`, not here.
class SocketCan final : public Interface {
 public:
  struct Statistics {
    std::uint64_t queue_full = 0;  ///< flushes that the kernel's queue ended
    std::uint64_t dropped = 0;     ///< frames taken by `send` that never reached the kernel
    std::uint64_t reports = 0;     ///< error frames of the controller
    std::uint64_t downs = 0;       ///< times the link was found down or gone
  };

  /// Throws std::runtime_error: interface name and reason, when the kernel has no CAN, the interface does not
  /// exist, is no CAN interface, or the socket cannot be set up.
  explicit SocketCan(const std::string& interface_name, const SocketCanOptions& options = {});
  ~SocketCan() override;
  SocketCan(const SocketCan&) = delete;
  SocketCan& operator=(const SocketCan&) = delete;

  [[nodiscard]] SendResult send(const Frame& frame) noexcept override;
  void flush() noexcept override;
  [[nodiscard]] bool receive(StampedFrame& out) noexcept override;
  [[nodiscard]] LinkState link() const noexcept override;
  [[nodiscard]] std::uint64_t receive_overflows() const noexcept override;
  [[nodiscard]] std::string_view name() const noexcept override;

  /// The socket, for an event loop to wait on. It is another one each time `generation` has gone up: the loop
  /// then has to take it up anew (closing took the old one out of any epoll set).
  [[nodiscard]] int descriptor() const noexcept;
  [[nodiscard]] std::uint64_t generation() const noexcept;
  /// Frames gathered and not yet taken by the kernel.
  [[nodiscard]] std::size_t waiting() const noexcept;
  /// Flushes until nothing waits, at most for `limit`; for the end of a run, not for cyclic code. False when
  /// something still waits.
  [[nodiscard]] bool flush_all(Time limit) noexcept;
  [[nodiscard]] const Statistics& statistics() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// State of a controller after it has sent the report `error_frame` (linux/can/error.h); `before` when the
/// report says nothing about the state.
[[nodiscard]] LinkState link_after(const Frame& error_frame, LinkState before) noexcept;

/// The report says that the controller itself lost a received frame.
[[nodiscard]] bool tells_receive_overflow(const Frame& error_frame) noexcept;

}  // namespace walkman::can
