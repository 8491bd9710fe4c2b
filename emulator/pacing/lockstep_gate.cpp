#include "emulator/pacing/lockstep_gate.h"

#include <algorithm>

#include "drivers/canopen/cob_id.h"

namespace walkman::clock {

bool is_sync(const can::Frame& frame) noexcept {
  return frame.id == canopen::cob_id::kSync && !frame.extended && !frame.remote && !frame.error &&
         frame.length <= 1;
}

void LockstepGate::receive(std::size_t bus, const can::Frame& frame, Time wall_now) {
  inboxes_[bus].frames.push_back(frame);
  if (is_sync(frame)) ++inboxes_[bus].syncs;
  last_arrival_ = wall_now;
}

bool LockstepGate::cycle_ready() const noexcept {
  return !inboxes_.empty() &&
         std::all_of(inboxes_.begin(), inboxes_.end(), [](const Inbox& inbox) { return inbox.syncs > 0; });
}

Time LockstepGate::serve_at(bool unfinished) const noexcept {
  const bool waiting = std::any_of(inboxes_.begin(), inboxes_.end(), [](const Inbox& inbox) {
    return !inbox.frames.empty() && !is_sync(inbox.frames.front());
  });
  return waiting || unfinished ? last_arrival_ + kQuiet : Time::max();
}

bool LockstepGate::take_before_sync(std::size_t bus, can::Frame& out) {
  std::deque<can::Frame>& frames = inboxes_[bus].frames;
  if (frames.empty() || is_sync(frames.front())) return false;
  out = frames.front();
  frames.pop_front();
  return true;
}

can::Frame LockstepGate::take_sync(std::size_t bus) {
  Inbox& inbox = inboxes_[bus];
  const can::Frame sync = inbox.frames.front();
  inbox.frames.pop_front();
  --inbox.syncs;
  return sync;
}

Time LockstepGate::next_sync(Time emulated_now) const noexcept {
  const auto cycles = (emulated_now.count() + period_.count() - 1) / period_.count();
  const Time on_grid{cycles * period_.count()};
  return clocked() ? std::max(on_grid, last_sync_ + period_) : on_grid;
}

Time LockstepGate::cycle_end(Time emulated_now) const noexcept {
  if (!clocked() || emulated_now >= last_sync_ + period_) return Time::max();
  return last_sync_ + period_;
}

}  // namespace walkman::clock
