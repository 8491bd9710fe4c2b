#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

namespace walkman::gateways {

/// Datagrams on their way to clients, sent by a separate thread at a rate for which a client's kernel has
/// room: sending does not wait for the next frame to be cast.
class PacedOutbox {
 public:
  /// IPv4 address and port, in the low 48 bits.
  using Address = std::uint64_t;

  /// `socket`: UDP, non-blocking, kept open by the caller. `drained`: called in the outbox's thread when
  /// there is room again after `full`.
  PacedOutbox(int socket, std::function<void()> drained);
  ~PacedOutbox();
  PacedOutbox(const PacedOutbox&) = delete;
  PacedOutbox& operator=(const PacedOutbox&) = delete;

  /// Whether so much is waiting that no more should be pushed.
  [[nodiscard]] bool full() const noexcept { return waiting_ >= kMost; }
  void push(Address to, std::vector<std::uint8_t> datagram);
  /// Discards what is waiting for a client whose port is closed.
  void drop(Address to);

 private:
  /// Two frames with both images.
  static constexpr std::size_t kMost = 8'000'000;  // bytes

  struct Queue {
    std::deque<std::vector<std::uint8_t>> datagrams;
    std::size_t bytes = 0;
    std::size_t burst = 0;  // bytes per millisecond for what waits now
  };
  void work();
  void send_bursts();
  /// Returns false if the kernel has no room.
  [[nodiscard]] bool send(Address to, const std::vector<std::uint8_t>& datagram) const;

  int socket_;
  std::function<void()> drained_;
  std::mutex mutex_;
  std::condition_variable filled_;
  std::map<Address, Queue> queues_;  // none is empty
  std::atomic<std::size_t> waiting_ = 0;
  bool was_full_ = false;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace walkman::gateways
