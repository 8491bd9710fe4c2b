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
  if (bus_->computer_end().send(frame) == can::SendResult::kQueued) {
    ++counters_.entered;
  } else {
    ++counters_.refused;
  }
}

bool Bridge::hand_out() noexcept {
  bool any = false;
  while (holding_ || bus_->computer_end().receive(held_)) {
    const can::SendResult result = outside_->send(held_.frame);
    holding_ = result == can::SendResult::kQueueFull;
    if (holding_) break;
    any = true;
    ++(result == can::SendResult::kQueued ? counters_.handed : counters_.undelivered);
  }
  if (any || holding_) outside_->flush();
  return !holding_;
}

}  // namespace walkman::bus
