#pragma once

#include <array>
#include <cstdint>

#include "drivers/can/frame.h"

namespace walkman::nodes {

/// The transmit mailboxes of a node's CAN controller: the most urgent identifier goes first, frames with the
/// same identifier in order of arrival. Bounded.
class Outbox {
 public:
  static constexpr std::size_t kCapacity = 32;

  /// Queues a frame; if full, drops and counts it.
  void push(const can::Frame& frame) noexcept;
  /// Overwrites the waiting frame with the same identifier, as a PDO's mailbox does; else like `push`.
  void replace(const can::Frame& frame) noexcept;
  void clear() noexcept { size_ = 0; }
  /// Drops the waiting frames with an identifier.
  void drop(std::uint32_t id) noexcept;
  [[nodiscard]] bool holds(std::uint32_t id) const noexcept;
  [[nodiscard]] bool full() const noexcept { return size_ == kCapacity; }

  [[nodiscard]] const can::Frame* front() const noexcept {
    return size_ == 0 ? nullptr : &frames_[size_ - 1];
  }
  void pop() noexcept { --size_; }
  [[nodiscard]] std::uint64_t overflows() const noexcept { return overflows_; }

 private:
  std::array<can::Frame, kCapacity> frames_;  // most urgent last
  std::size_t size_ = 0;
  std::uint64_t overflows_ = 0;
};

}  // namespace walkman::nodes
