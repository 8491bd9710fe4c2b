#include "emulator/bus/bridge.h"

namespace walkman::bus {

bool Bridge::receive(can::Frame& out) noexcept {
  can::StampedFrame stamped;
  while (outside_->receive(stamped)) {
    if (stamped.frame.error) continue;
    out = stamped.frame;
    return true;
  }
  return false;
}

void Bridge::enter(const can::Frame& frame) noexcept {
  if (bus_->computer_port().send(frame) == can::SendResult::kQueued) {
    ++counters_.entered;
  } else {
    ++counters_.refused;
  }
}

bool Bridge::hand_out() noexcept {
  while (holding_ || bus_->computer_port().receive(held_)) {
    const can::SendResult result = outside_->send(held_.frame);
    holding_ = result == can::SendResult::kQueueFull;
    if (holding_) break;
    ++(result == can::SendResult::kQueued ? counters_.handed : counters_.undelivered);
  }
  outside_->flush();
  return !holding_;
}

}  // namespace walkman::bus
