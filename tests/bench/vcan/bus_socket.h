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

/// A frame of the kernel's, with these bytes.
can_frame frame_of(std::uint32_t can_id, std::initializer_list<int> bytes);

/// A raw CAN socket as any program would open it; knows nothing of the stack it measures.
class BusSocket {
 public:
  /// Throws std::runtime_error with one sentence if the interface cannot be opened.
  explicit BusSocket(const std::string& interface);
  ~BusSocket();
  BusSocket(const BusSocket&) = delete;
  BusSocket& operator=(const BusSocket&) = delete;

  void send(const can_frame& frame);
  /// All in one system call.
  void send(const can_frame* frames, unsigned count);

  /// Gives every frame that comes to `wanted` until it says that it has what it waited for; throws
  /// std::runtime_error after a second without.
  void receive_until(const std::function<bool(const can_frame&)>& wanted);

  /// Forgets what is queued.
  void drain();

 private:
  static constexpr unsigned kBatch = 64;
  unsigned receive(bool wait);

  int socket_ = -1;
  std::array<can_frame, kBatch> frames_{};
};

}  // namespace walkman::bench
