#include "emulator/pacing/lockstep_inboxes.h"

#include <algorithm>

#include "drivers/canopen/cob_id.h"

namespace walkman::pacing {

bool is_sync(const can::Frame& frame) noexcept {
  return frame.id == canopen::cob_id::kSync && !frame.extended && !frame.remote && !frame.error &&
         frame.length <= 1;
}

void LockstepInboxes::receive(std::size_t bus, const can::Frame& frame, Time wall_now) {
  buses_[bus].frames.push_back(frame);
  if (is_sync(frame)) ++buses_[bus].syncs;
  last_arrival_ = wall_now;
  quiet_since_ = wall_now;
}

bool LockstepInboxes::cycle_ready() const noexcept {
  return !buses_.empty() &&
         std::all_of(buses_.begin(), buses_.end(), [](const Inbox& inbox) { return inbox.syncs > 0; });
}

Time LockstepInboxes::incomplete_cycle_at() const noexcept {
  const auto with =
      std::count_if(buses_.begin(), buses_.end(), [](const Inbox& inbox) { return inbox.syncs > 0; });
  const bool some = with > 0 && with < static_cast<std::ptrdiff_t>(buses_.size());
  return some ? last_arrival_ + kMissing : Time::max();
}

Time LockstepInboxes::serve_at(bool unfinished) const noexcept {
  const bool waiting = std::any_of(buses_.begin(), buses_.end(), [](const Inbox& inbox) {
    return !inbox.frames.empty() && !is_sync(inbox.frames.front());
  });
  return waiting || unfinished ? quiet_since_ + kQuiet : Time::max();
}

bool LockstepInboxes::take_before_sync(std::size_t bus, can::Frame& out) {
  std::deque<can::Frame>& frames = buses_[bus].frames;
  if (frames.empty() || is_sync(frames.front())) return false;
  out = frames.front();
  frames.pop_front();
  return true;
}

can::Frame LockstepInboxes::take_sync(std::size_t bus) {
  Inbox& inbox = buses_[bus];
  const can::Frame sync = inbox.frames.front();
  inbox.frames.pop_front();
  --inbox.syncs;
  return sync;
}

Time LockstepInboxes::next_sync(Time emulated_now) const noexcept {
  const auto cycles = (emulated_now.count() + period_.count() - 1) / period_.count();
  const Time on_grid{cycles * period_.count()};
  return clocked() ? std::max(on_grid, last_sync_ + period_) : on_grid;
}

Time LockstepInboxes::cycle_end(Time emulated_now) const noexcept {
  if (!clocked() || emulated_now >= last_sync_ + period_) return Time::max();
  return last_sync_ + period_;
}

}  // namespace walkman::pacing
