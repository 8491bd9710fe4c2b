#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <string>

#include <linux/can.h>

namespace walkman::bench {

using SteadyClock = std::chrono::steady_clock;

/// Returns a frame of the kernel's type with these bytes.
can_frame frame_of(std::uint32_t can_id, std::initializer_list<int> bytes);

/// A raw CAN socket as any program would open it; independent of the stack that it measures.
class BusSocket {
 public:
  /// Throws std::runtime_error with one sentence if the interface cannot be opened.
  explicit BusSocket(const std::string& interface);
  ~BusSocket();
  BusSocket(const BusSocket&) = delete;
  BusSocket& operator=(const BusSocket&) = delete;

  void send(const can_frame& frame);
  /// Sends all frames in one system call.
  void send(const can_frame* frames, unsigned count);

  /// Passes every received frame to `wanted` until that returns true; throws std::runtime_error after a
  /// second without success.
  void receive_until(const std::function<bool(const can_frame&)>& wanted);

  /// Discards the queued frames.
  void drain();

 private:
  static constexpr unsigned kBatch = 64;
  unsigned receive(bool wait);

  int socket_ = -1;
  std::array<can_frame, kBatch> frames_{};
};

}  // namespace walkman::bench
