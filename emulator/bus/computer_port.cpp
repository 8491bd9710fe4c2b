#include "emulator/bus/computer_port.h"

#include "emulator/bus/frame_length.h"

namespace walkman::bus {

can::SendResult ComputerPort::send(const can::Frame& frame) noexcept {
  if ((frame.fd && !fd_) || !is_sendable(frame)) return can::SendResult::kInvalid;
  if (link() == can::LinkState::kBusOff || link() == can::LinkState::kDown)
    return can::SendResult::kInterfaceDown;
  if (host_ == HostSide::kDeserted) return can::SendResult::kQueued;
  if (host_ == HostSide::kFull) return can::SendResult::kQueueFull;
  if (transmit_.push(frame)) return can::SendResult::kQueued;
  ++transmit_overflows_;
  return can::SendResult::kQueueFull;
}

bool ComputerPort::receive(can::StampedFrame& out) noexcept {
  if (receive_.empty()) return false;
  out = receive_.front();
  receive_.pop();
  return true;
}

void ComputerPort::set_host_side(HostSide host) noexcept {
  host_ = host;
  if (host != HostSide::kDown) return;
  while (!transmit_.empty()) transmit_.pop();
  while (!receive_.empty()) receive_.pop();
}

void ComputerPort::receive(const can::Frame& frame, Time now) noexcept {
  if (host_ == HostSide::kDown) return;
  if (!receive_.push({now, frame})) ++receive_overflows_;
}

void ComputerPort::advance(Time now) noexcept {
  if (restart_at_ > now) return;
  restart_at_ = Time::max();
  restart();
}

void ComputerPort::on_link_state(can::LinkState state, Time now) noexcept {
  state_ = state;
  restart_ = false;
  restart_at_ = Time::max();
  if (state != can::LinkState::kBusOff) return;
  while (!transmit_.empty()) transmit_.pop();
  if (options_.restart_after > Time{}) restart_at_ = now + options_.restart_after;
}

}  // namespace walkman::bus
