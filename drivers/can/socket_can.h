#pragma once

#include <memory>
#include <string>
#include <vector>

#include "drivers/can/interface.h"

namespace walkman::can {

struct SocketCanOptions {
  bool listens = true;        ///< receives other sockets' and nodes' frames, any format; else only reports
  bool error_frames = false;  ///< `receive` also returns the controller's reports (`Frame::error`)
  bool stamps = true;         ///< frames carry their receive time; if false, no clock is read for them
  int receive_buffer = 4 * 1024 * 1024;  ///< bytes requested from the kernel, which may grant less
  std::size_t transmit_queue = 128;      ///< maximum number of frames collected, 1 to 1024
};

/// Options for a socket that stands for a bus's devices: also receives the controller's reports. Its own
/// frames are not received; other sockets of the same host receive them.
[[nodiscard]] SocketCanOptions device_side_options();

/// A network interface of the Linux kernel (vcan, can) as a connection to a bus: one non-blocking CAN_RAW
/// socket.
///
/// `send` collects frames and `flush` hands them to the kernel in one call. Frames that the kernel's queue
/// does not accept (ENOBUFS, EAGAIN) stay collected, in order, and are offered again by the next `flush`; if
/// the collecting buffer is full, too, `send` returns `kQueueFull`. Frames carry the kernel's receive time,
/// converted to CLOCK_MONOTONIC.
///
/// If the link is down, gone or bus-off, `send` returns kInterfaceDown and the collected frames are dropped:
/// set-points from before a failure are worthless after it. After `ip link set up` or a bus-off restart the
/// same socket continues to work. After the interface has been deleted, a new socket is opened as soon as an
/// interface of that name exists; this is checked once between two calls of `flush`, and in `receive` every
/// 100 ms. Bit rate and restart time are set with `ip link`, not here.
class SocketCan final : public Interface {
 public:
  struct Statistics {
    std::uint64_t queue_full = 0;  ///< flushes cut short by a full kernel queue
    std::uint64_t dropped = 0;     ///< frames accepted by `send` that never reached the kernel
    std::uint64_t reports = 0;     ///< error frames from the controller
    std::uint64_t downs = 0;       ///< times the link was found down or gone
  };

  /// Throws std::runtime_error with interface name and reason if the kernel has no CAN, the interface does
  /// not exist or is not a CAN interface, or the socket cannot be set up.
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

  /// The socket, for an event loop to wait on. Whenever `generation` has increased it is a new one: the loop
  /// must then register it again (closing removed the old one from any epoll set).
  [[nodiscard]] int descriptor() const noexcept;
  [[nodiscard]] std::uint64_t generation() const noexcept;
  /// Frames collected and not yet accepted by the kernel.
  [[nodiscard]] std::size_t waiting() const noexcept;
  /// Flushes until no frame is waiting, at most for `limit`; for the end of a run, not for cyclic code.
  /// Returns false if frames are still waiting.
  [[nodiscard]] bool flush_all(Time limit) noexcept;
  [[nodiscard]] const Statistics& statistics() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// State of a controller after it has sent the report `error_frame` (linux/can/error.h); `before` if the
/// report says nothing about the state.
[[nodiscard]] LinkState link_after(const Frame& error_frame, LinkState before) noexcept;

/// Whether the report says that the controller itself lost a received frame.
[[nodiscard]] bool tells_receive_overflow(const Frame& error_frame) noexcept;

}  // namespace walkman::can
