#include "emulator/bus/computer_end.h"

namespace walkman::bus {

can::SendResult ComputerEnd::send(const can::Frame& frame) noexcept {
  if (frame.fd || frame.length > 8 || frame.id > (frame.extended ? 0x1FFFFFFFU : 0x7FFU)) {
    return can::SendResult::kInterfaceDown;
  }
  if (transmit_.push(frame)) return can::SendResult::kQueued;
  ++transmit_overflows_;
  return can::SendResult::kQueueFull;
}

bool ComputerEnd::receive(can::StampedFrame& out) noexcept {
  if (receive_.empty()) return false;
  out = receive_.front();
  receive_.pop();
  return true;
}

void ComputerEnd::receive(const can::Frame& frame, Time now) noexcept {
  if (!receive_.push({now, frame})) ++receive_overflows_;
}

}  // namespace walkman::bus
