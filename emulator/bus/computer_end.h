#pragma once

#include <string>

#include "drivers/can/interface.h"
#include "emulator/bus/participant.h"
#include "emulator/bus/ring.h"

namespace walkman::bus {

/// The computer's CAN controller on an emulated bus: a participant on the wire's side, a `can::Interface` on
/// the computer's. As with SocketCAN, its transmit queue is first-in first-out: only the oldest frame takes
/// part in arbitration.
class ComputerEnd final : public Participant, public can::Interface {
 public:
  static constexpr std::size_t kQueueLength = 4096;

  explicit ComputerEnd(std::string name)
      : name_(std::move(name)), transmit_(kQueueLength), receive_(kQueueLength) {}

  /// A frame that a classical bus cannot carry (FD, more than 8 bytes, identifier too long) is refused with
  /// kInterfaceDown.
  [[nodiscard]] can::SendResult send(const can::Frame& frame) noexcept override;
  [[nodiscard]] bool receive(can::StampedFrame& out) noexcept override;
  [[nodiscard]] std::uint64_t receive_overflows() const noexcept override { return receive_overflows_; }
  [[nodiscard]] std::string_view name() const noexcept override { return name_; }

  void receive(const can::Frame& frame, Time now) noexcept override;
  void advance(Time) noexcept override {}
  [[nodiscard]] Time next_event() const noexcept override { return Time::max(); }
  [[nodiscard]] const can::Frame* pending() const noexcept override {
    return transmit_.empty() ? nullptr : &transmit_.front();
  }
  void take() noexcept override { transmit_.pop(); }
  [[nodiscard]] std::uint64_t transmit_overflows() const noexcept override { return transmit_overflows_; }

 private:
  std::string name_;
  Ring<can::Frame> transmit_;
  Ring<can::StampedFrame> receive_;
  std::uint64_t transmit_overflows_ = 0;
  std::uint64_t receive_overflows_ = 0;
};

}  // namespace walkman::bus
